#include "nn/losses/deformation.h"

#include <cmath>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"
#include "autograd/ops/rotation.h"
#include "nn/models/motion.h"

namespace restage {

namespace {

/// The networks read `seen_*`; the other points and joints are skinned.
DeformationOutput deform(Context& ctx, const DeformationModel& weights, const OffsetNet* offsets,
                         const Var& seen_points, const Var& seen_joints, const Var& rest_points,
                         const Var& rest_joints, const Var& local, const Var& axis_angle) {
  const int64_t n = rest_points.size(0);
  DeformationOutput out;
  out.weights = weights.weights(ctx, seen_joints, seen_points);
  Var x = rest_points;
  if (offsets != nullptr) {
    out.offsets = offsets->at_points(ctx, axis_angle, seen_points);
    x = x + out.offsets;
  }
  const Var root = reshape(slice(rest_joints, 1, 0, 1), {n, 3});
  const Var transforms = forward_kinematics(local, rest_joints, root, joint_parents());
  out.posed = linear_blend_skinning(x, out.weights, transforms, rest_joints);
  return out;
}

}  // namespace

DeformationOutput deform(Context& ctx, const DeformationModel& weights, const OffsetNet* offsets,
                         const Var& rest_points, const Var& rest_joints, const Var& local,
                         const Var& axis_angle) {
  return deform(ctx, weights, offsets, rest_points, rest_joints, rest_points, rest_joints, local,
                axis_angle);
}

DeformationOutput deform(Context& ctx, const DeformationModel& weights, const OffsetNet* offsets,
                         const DeformationBatch& b) {
  const Tensor& points = b.seen_points.defined() ? b.seen_points : b.rest_points;
  const Tensor& joints = b.seen_joints.defined() ? b.seen_joints : b.rest_joints;
  return deform(ctx, weights, offsets, points, joints, b.rest_points, b.rest_joints, b.local,
                b.axis_angle);
}

Var skin_cross_entropy(const Var& weights, const Tensor& truth) {
  return neg(sum_all(log(add_scalar(weights, 1e-6)) * Var(truth)));
}

Var distance_sum(const Var& posed, const Var& truth, Measure measure) {
  return sum_all(errors(posed - truth, measure));
}

double mean_distance(const Tensor& a, const Tensor& b) {
  double total = 0;
  const int64_t rows = a.numel() / 3;
  for (int64_t i = 0; i < rows; ++i) {
    double d2 = 0;
    for (int64_t c = 0; c < 3; ++c) {
      const double d = a.item(3 * i + c) - b.item(3 * i + c);
      d2 += d * d;
    }
    total += std::sqrt(d2);
  }
  return total / static_cast<double>(rows);
}

}  // namespace restage
