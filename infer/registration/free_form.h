// The last freedom of a registration: every node has an affine map of its own that differs little
// from its neighbours', less and less stiffly. The optimal-step algorithm of Amberg, Romdhani and
// Vetter, "Optimal step nonrigid ICP algorithms for surface registration" (CVPR 2007), without
// landmarks and with robust weights.
#pragma once

#include "infer/registration/articulated.h"

namespace restage {

struct FreeFormOptions {
  std::vector<double> stiffness = {1.0, 0.3, 0.1, 0.03};  ///< from stiff to soft
  int steps = 3;                                          ///< correspondences a stiffness
  double width = 0.06;                                    ///< of the kernel, metres
};

/// Where the nodes end.
std::vector<Vec3> fit_free_form(const Rig& rig, const PosedRig& posed,
                                const std::vector<Vec3>& cloud,
                                const FreeFormOptions& options = {});

/// The pose whose joints turn their nodes as the free form did: for each joint the rotation that
/// takes `posed` nodes, weighted by how much it carries them, onto `moved` ones (Kabsch 1976); the
/// pelvis moves with the middle of its nodes.
Pose refit_pose(const Rig& rig, const PosedRig& posed, const std::vector<Vec3>& moved);

}  // namespace restage
