#include "nn/models/deformation.h"

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/linear.h"
#include "autograd/ops/reduce.h"
#include "autograd/ops/rotation.h"
#include "nn/models/motion.h"

namespace restage {

Mlp3::Mlp3(int64_t in, int64_t out, const MlpConfig& c, bool softmax, const Init& init)
    : fc1(in, c.width, init.sub("fc1")),
      fc2(c.width, c.width, init.sub("fc2")),
      fc3(c.width, out, init.sub("fc3")),
      dropout_rate(c.dropout),
      with_softmax(softmax) {
  if (c.small_start) fc3.start_small();
}

// ReLU and dropout commute, since the mask is never negative; without dropout ReLU is part of the
// product.
template <class Layer>
Var Mlp3::hidden(Context& ctx, Layer&& layer) const {
  if (!ctx.training || dropout_rate <= 0) return layer(Activation::relu);
  return relu_dropout(ctx, layer(Activation::none), dropout_rate);
}

Var Mlp3::from_first(Context& ctx, const Var& h1) const {
  const Var h2 = hidden(ctx, [&](Activation a) { return fc2(ctx, h1, a); });
  const Var y = fc3(ctx, h2);
  return with_softmax ? softmax(y) : y;
}

Var Mlp3::operator()(Context& ctx, const Var& x) const {
  const ModuleScope path(scope);
  return from_first(ctx, hidden(ctx, [&](Activation a) { return fc1(ctx, x, a); }));
}

// W [vector; p] + b = [W_p, (W_c vectors + b)] [p; one], with `one` the unit vector of the sample:
// a product of n + 3 columns, whose gradient gives the gradient of the vectors' part as well.
Var Mlp3::at_points(Context& ctx, const Var& vector, const Var& points) const {
  const int64_t n = points.size(0), v = points.size(1), c = vector.size(1);
  if (n > c) return (*this)(ctx, join_points(vector, points));
  const ModuleScope path(scope);
  Tensor one = Tensor::zeros({n, v, n}, points.dtype());
  for (int64_t i = 0; i < n; ++i)
    for (int64_t j = 0; j < v; ++j) {
      const int64_t at = (i * v + j) * n + i;
      points.dtype() == DType::f64 ? one.data<double>()[at] = 1 : one.data<float>()[at] = 1;
    }
  const Vars w = split(ctx.bind(fc1.weight), 1, {c, 3});
  const Var of_vectors = linear(vector, w[0], ctx.bind(fc1.bias));
  const Var both = concat({w[1], permute(of_vectors, {1, 0})}, 1);
  const Var x = concat({points, Var(one.to(points.value.device()))}, 2);
  return from_first(ctx, hidden(ctx, [&](Activation a) { return call(LinearOp{a}, {x, both}); }));
}

Var Mlp3::with_masks(Context& ctx, const Var& x, const Tensor& mask1, const Tensor& mask2) const {
  const ModuleScope path(scope);
  const double factor = 1.0 / (1.0 - dropout_rate);
  const Var h1 = scale(fc1(ctx, x, Activation::relu) * Var(mask1), factor);
  const Var h2 = scale(fc2(ctx, h1, Activation::relu) * Var(mask2), factor);
  const Var y = fc3(ctx, h2);
  return with_softmax ? softmax(y) : y;
}

void Mlp3::visit(Fields& f) {
  f("fc1", fc1);
  f("fc2", fc2);
  f("fc3", fc3);
}

Var WeightNet::weights(Context& ctx, const Var& rest, const Var& points) const {
  const ModuleScope path(scope);
  return net.at_points(ctx, reshape(rest, {rest.size(0), 3 * kJoints}), points);
}

Var V1Field::weights(Context& ctx, const Var& rest, const Var& points) const {
  const ModuleScope path(scope);
  return net(ctx, joint_differences(points, rest));
}

Var join_points(const Var& vector, const Var& points) {
  const int64_t n = points.size(0), v = points.size(1), c = vector.size(1);
  return concat({expand(reshape(vector, {n, 1, c}), {n, v, c}), points}, 2);
}

Var joint_differences(const Var& points, const Var& joints) {
  const int64_t n = points.size(0), v = points.size(1), j = joints.size(1);
  return reshape(reshape(points, {n, v, 1, 3}) - reshape(joints, {n, 1, j, 3}), {n, v, 3 * j});
}

namespace {

/// `seen_*` is what the networks read, the others what is skinned.
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

}  // namespace restage
