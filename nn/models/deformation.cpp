#include "nn/models/deformation.h"

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"

namespace restage {

Mlp3::Mlp3(int64_t in, int64_t out, int64_t width, double dropout, bool softmax, const Init& init)
    : fc1(in, width, init.sub("fc1")),
      fc2(width, width, init.sub("fc2")),
      fc3(width, out, init.sub("fc3")),
      dropout_rate(dropout),
      with_softmax(softmax) {}

Var Mlp3::operator()(Context& ctx, const Var& x) const {
  const ModuleScope path(scope);
  // ReLU and dropout commute, since the mask is never negative.
  const Var h1 = dropout(ctx, fc1(ctx, x, Activation::relu), dropout_rate, "dropout1");
  const Var h2 = dropout(ctx, fc2(ctx, h1, Activation::relu), dropout_rate, "dropout2");
  const Var y = fc3(ctx, h2);
  return with_softmax ? softmax(y) : y;
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

std::unique_ptr<Mlp3> make_weight_net(const Init& init, int64_t width) {
  return std::make_unique<Mlp3>(3 * kJoints + 3, kJoints, width, 0.2, true, init);
}
std::unique_ptr<Mlp3> make_offset_net(const Init& init, int64_t width) {
  return std::make_unique<Mlp3>(3 * kJoints + 3, 3, width, 0.2, false, init);
}
std::unique_ptr<Mlp3> make_root_net(const Init& init, int64_t width) {
  return std::make_unique<Mlp3>(3 * kJoints, 3, width, 0.2, false, init);
}
std::unique_ptr<Mlp3> make_v1_field(const Init& init, int64_t width) {
  return std::make_unique<Mlp3>(3 * kJoints, kJoints, width, 0.2, true, init);
}

Var join_points(const Var& vector, const Var& points) {
  const int64_t n = points.size(0), v = points.size(1), c = vector.size(1);
  return concat({expand(reshape(vector, {n, 1, c}), {n, v, c}), points}, 2);
}

Var joint_differences(const Var& points, const Var& joints) {
  const int64_t n = points.size(0), v = points.size(1), j = joints.size(1);
  return reshape(reshape(points, {n, v, 1, 3}) - reshape(joints, {n, 1, j, 3}), {n, v, 3 * j});
}

}  // namespace restage
