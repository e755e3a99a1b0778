// Fits a rig to one cloud by iterated closest points. Fitted are the rotations of all joints, the
// lengths of the bones, size and place, by damped Gauss-Newton steps. Every node is matched with
// the nearest point and every point with the nearest node. Matches are weighted by Geman and
// McClure's kernel, whose width shrinks from arm's length to the size of the noise (annealing).
// After Pellegrini, Schindler and Nardi, "A generalisation of the ICP algorithm for articulated
// bodies" (BMVC 2008), and Zhou, Park and Koltun, "Fast global registration" (ECCV 2016).
#pragma once

#include "infer/registration/rig.h"

namespace restage {

/// Pose and build of a rig.
struct RigState {
  Pose pose;         ///< local rotations; pelvis in the cloud's frame
  double scale = 1;  ///< factor of all lengths, of bones and of flesh
  /// Factor of the length of the bone that ends in a joint, besides `scale`; the same for the left
  /// and the right side.
  std::array<double, kJoints> stretch = [] {
    std::array<double, kJoints> ones;
    ones.fill(1);
    return ones;
  }();
};

struct PosedRig {
  PosedSkeleton skeleton;
  std::vector<Vec3> nodes, normals;
};

/// The rest joints of a body whose build is that of `state`; its pelvis is that of `rest`.
Joints built(const Joints& rest, const RigState& state);
PosedRig pose_rig(const Rig& rig, const RigState& state);

struct ArticulatedOptions {
  int iterations = 30;
  /// Width of the kernel in the first and in the last iteration, metres.
  double widest = 0.30, narrowest = 0.06;
  /// Costs that are added to the mean squared distance (square metres): of the squared relative
  /// difference of the size, and of the bones' lengths, from the target's; `turns` is a factor of
  /// the costs of rotations.
  double size = 3e-4, stretch = 3e-3, turns = 1;
};

/// How badly a posed rig fits a cloud: the mean cost of the distances from nodes to the cloud and
/// from the cloud to nodes. A distance costs less than the square of `width`, however large the
/// distance. Used to compare candidates.
double misfit(const PosedRig& posed, const std::vector<Vec3>& cloud, double width);

/// The state fitted to a cloud, with `state` as the start. The same input gives the same bits.
RigState fit_articulated(const Rig& rig, const std::vector<Vec3>& cloud, RigState state,
                         const ArticulatedOptions& options = {});

}  // namespace restage
