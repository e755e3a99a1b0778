#include "nn/models/linear_body.h"

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/linear.h"
#include "autograd/ops/rotation.h"

namespace restage {
namespace {

/// x [...] repeated for each of n items.
Var for_each_of(int64_t n, const Tensor& x) {
  Shape one{1}, all{n};
  for (int i = 0; i < x.rank(); ++i) {
    one.push_back(x.size(i));
    all.push_back(x.size(i));
  }
  return expand(Var(x.reshape(one)), all);
}

}  // namespace

Var shaped(const Tensor& mean, const Tensor& directions, const Var& shape) {
  const int64_t p = mean.size(0), b = directions.size(2);
  return reshape(linear(shape, Var(directions.reshape({3 * p, b}))), {shape.size(0), p, 3}) +
         Var(mean);
}

Var pose_body(const LinearBody& body, const Var& shape, const Var& poses) {
  const int64_t n = poses.size(0), t = poses.size(1), j = poses.size(2) / 3;
  const int64_t v = body.mean.size(0);
  const auto each_frame = [&](const Var& x) {
    return reshape(expand(reshape(x, {n, 1, x.size(1), 3}), {n, t, x.size(1), 3}),
                   {n * t, x.size(1), 3});
  };
  const Var rest = each_frame(shaped(body.mean, body.directions, shape));
  const Var joints = each_frame(shaped(body.joint_mean, body.joint_directions, shape));
  const Var local = axis_angle_to_matrix(reshape(poses, {n * t, j, 3}));
  const Var root = reshape(slice(joints, 1, 0, 1), {n * t, 3});
  const Var posed = forward_kinematics(local, joints, root, body.parents);
  return reshape(linear_blend_skinning(rest, for_each_of(n * t, body.weights), posed, joints),
                 {n, t, v, 3});
}

}  // namespace restage
