// The last step of a registration, for differences of shape that the rig cannot follow: every node
// gets an affine map of its own. The maps of neighbours must differ little at first and may differ
// more later. The optimal-step algorithm of Amberg, Romdhani and Vetter, "Optimal step nonrigid ICP
// algorithms for surface registration" (CVPR 2007), without landmarks and with robust weights.
#pragma once

#include "infer/registration/articulated.h"

namespace restage {

struct FreeFormOptions {
  std::vector<double> stiffness = {1.0, 0.3, 0.1, 0.03};  ///< one after the other
  int steps = 3;        ///< how often nodes and points are matched anew at each stiffness
  double width = 0.06;  ///< width of the kernel that weights matches, metres
};

/// The places of the nodes after the fit.
std::vector<Vec3> fit_free_form(const Rig& rig, const PosedRig& posed,
                                const std::vector<Vec3>& cloud,
                                const FreeFormOptions& options = {});

/// The pose whose joints turn the nodes as fit_free_form() did. For each joint it is the rotation
/// that takes the `posed` nodes onto the `moved` ones best, a node counting as much as the joint
/// carries it (Kabsch 1976). The pelvis moves with the middle of the nodes that it carries.
Pose refit_pose(const Rig& rig, const PosedRig& posed, const std::vector<Vec3>& moved);

}  // namespace restage
