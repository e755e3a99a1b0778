// Rotations and skeletons. Conversions work on rows; spec 3.4, 3.5, 5.2. f32 and f64.
#pragma once

#include <span>

#include "autograd/kernels/kernel.h"

namespace restage {

enum class RotationForm { sixd, quaternion, axis_angle };

/// x [n, 6 | 4 | 3] -> out [n, 9] (row-major 3x3).
struct ToMatrixArgs {
  RotationForm form;
  const Tensor& x;
  Tensor& out;
};
struct ToMatrixGradArgs {
  RotationForm form;
  const Tensor& x;
  const Tensor& gy;
  Tensor& out;
};
/// x [n, 9] -> out [n, 4] (w >= 0) or [n, 3] (angle in [0, pi]). No gradient.
struct FromMatrixArgs {
  RotationForm form;
  const Tensor& x;
  Tensor& out;
};
/// local [n, j, 9], rest [n, j, 3], root [n, 3] -> out [n, j, 12] = rows of [G | P].
struct FkArgs {
  const Tensor& local;
  const Tensor& rest;
  const Tensor& root;
  std::span<const int> parents;
  Tensor& out;
};
/// out is the gradient of local.
struct FkGradArgs {
  const Tensor& local;
  const Tensor& rest;
  const Tensor& transforms;
  const Tensor& gy;
  std::span<const int> parents;
  Tensor& out;
  Tensor& g_rest;
  Tensor& g_root;
};
/// How a joint of swing_twist turns. A leaf (no child) turns with its parent. A joint with `left`
/// and `right` is turned by the frame of (right -> left, itself -> child) as far as it has one; any
/// other by the shortest arc from its bone, carried along by the parent, to the posed bone, then by
/// its twist about that. A bone or frame without a direction turns with the parent.
struct SwingJoint {
  int parent = -1, child = -1, left = -1, right = -1;  ///< -1: none
};
/// rest, posed [n, j, 3], twist [n, j] radians -> out [n, j, 9] local rotations. f32 is computed in
/// double.
struct SwingTwistArgs {
  const Tensor& rest;
  const Tensor& posed;
  const Tensor& twist;
  std::span<const SwingJoint> joints;
  Tensor& out;
};
/// out is the gradient of posed. The gradient through an arc of more than 172 degrees, whose axis
/// means little, is zero.
struct SwingTwistGradArgs {
  const Tensor& rest;
  const Tensor& posed;
  const Tensor& twist;
  const Tensor& gy;
  std::span<const SwingJoint> joints;
  Tensor& out;
  Tensor& g_rest;
  Tensor& g_twist;
};
/// points [n, v, 3], weights [n, v, j], transforms [n, j, 12], rest [n, j, 3] -> out [n, v, 3].
struct LbsArgs {
  const Tensor& points;
  const Tensor& weights;
  const Tensor& transforms;
  const Tensor& rest;
  Tensor& out;
};
/// out is the gradient of points.
struct LbsGradArgs {
  const Tensor& points;
  const Tensor& weights;
  const Tensor& transforms;
  const Tensor& rest;
  const Tensor& gy;
  Tensor& out;
  Tensor& g_weights;
  Tensor& g_transforms;
  Tensor& g_rest;
};

}  // namespace restage
