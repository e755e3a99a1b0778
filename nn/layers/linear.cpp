#include "nn/layers/linear.h"

#include <cmath>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"

namespace restage {

Linear::Linear(int64_t in, int64_t out, const Init& init, bool with_bias, int tail)
    : with_bias_(with_bias), tail_(tail) {
  Shape shape{out, in};
  for (int i = 0; i < tail; ++i) shape.push_back(1);
  weight.value = init.weight(shape, in, out);
  if (with_bias) bias.value = init.bias(in, out);
}

Var Linear::matrix(Context& ctx) const {
  const Var w = ctx.bind(weight);
  return tail_ > 0 ? reshape(w, {w.size(0), w.size(1)}) : w;
}

Var Linear::operator()(Context& ctx, const Var& x, Activation activation) const {
  const ModuleScope path(scope);
  const Var w = matrix(ctx);
  if (with_bias_) return linear(x, w, ctx.bind(bias), activation);
  return call(LinearOp{activation}, {x, w});
}

void Linear::start_small() {
  std::vector<double> w = weight.value.to_vector<double>();
  for (double& v : w) v *= 0.01;
  weight.value = Tensor::from<double>(weight.value.shape(), w).cast(weight.value.dtype());
  if (with_bias_) bias.value = Tensor::zeros(bias.value.shape(), bias.value.dtype());
}

void Linear::visit(Fields& f) {
  f("weight", weight);
  if (with_bias_) f("bias", bias);
}

Conv1d::Conv1d(int64_t in, int64_t out, int64_t k, const Init& init) {
  weight.value = init.weight({out, in, k}, in * k, out * k);
  bias.value = init.bias(in * k, out);
}

Var Conv1d::same(Context& ctx, const Var& x, int64_t stride) const {
  const ModuleScope path(scope);
  const int64_t l = x.size(1), k = weight.value.size(2);
  if (stride < 1)
    shape_error("conv1d", "x[n, l, c], W[o, c, k], b[o]",
                std::array{x.value, weight.value, bias.value}, "the stride must be positive");
  const int64_t steps = (l + stride - 1) / stride;
  const int64_t pad = std::max<int64_t>((steps - 1) * stride + k - l, 0);
  return conv1d(x, ctx.bind(weight), ctx.bind(bias), stride, pad / 2, steps);
}

Var Conv1d::valid(Context& ctx, const Var& x, int64_t stride) const {
  const ModuleScope path(scope);
  const int64_t l = x.size(1), k = weight.value.size(2);
  if (l < k || stride < 1)
    shape_error("conv1d", "x[n, l, c], W[o, c, k], b[o]",
                std::array{x.value, weight.value, bias.value},
                stride < 1 ? "the stride must be positive" : "l is shorter than k");
  return conv1d(x, ctx.bind(weight), ctx.bind(bias), stride, 0, (l - k) / stride + 1);
}

void Conv1d::visit(Fields& f) {
  f("weight", weight);
  f("bias", bias);
}

Var dropout(Context& ctx, const Var& x, double p) {
  if (!ctx.training || p <= 0) return x;
  return dropout(x, p, ctx.next_mask());
}

Var relu_dropout(Context& ctx, const Var& x, double p) {
  if (!ctx.training || p <= 0) return relu(x);
  return relu_dropout(x, p, ctx.next_mask());
}

}  // namespace restage
