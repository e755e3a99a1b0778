// A rig fitted to one cloud by iterated closest points: rotations of all joints, lengths of the
// bones, size and place. Gauss-Newton with damping; correspondences both ways, weighted by Geman
// and McClure's kernel, whose width shrinks from arm's length to the noise (annealing).
// After Pellegrini, Schindler and Nardi, "A generalisation of the ICP algorithm for articulated
// bodies" (BMVC 2008), and Zhou, Park and Koltun, "Fast global registration" (ECCV 2016).
#pragma once

#include "infer/registration/rig.h"

namespace restage {

/// A rig in some pose and of some build.
struct RigState {
  Pose pose;         ///< local rotations; pelvis in the cloud's frame
  double scale = 1;  ///< of bones and flesh
  /// Of the bone that ends in a joint, besides `scale`; the same left and right.
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

/// Rest joints of that build; the pelvis stays.
Joints built(const Joints& rest, const RigState& state);
PosedRig pose_rig(const Rig& rig, const RigState& state);

struct ArticulatedOptions {
  int iterations = 30;
  double widest = 0.30, narrowest = 0.06;  ///< of the kernel, first and last iteration, metres
  /// Cost of a relative difference of size, of bone lengths, and of turns (a factor), squared,
  /// beside mean squared distances in metres.
  double size = 3e-4, stretch = 3e-3, turns = 1;
};

/// Mean cost of distances between nodes and cloud, both ways, below `width` squared: what
/// candidates are compared by.
double misfit(const PosedRig& posed, const std::vector<Vec3>& cloud, double width);

/// The state fitted to a cloud, from a start. Deterministic.
RigState fit_articulated(const Rig& rig, const std::vector<Vec3>& cloud, RigState state,
                         const ArticulatedOptions& options = {});

}  // namespace restage
