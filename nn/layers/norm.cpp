#include "nn/layers/norm.h"

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/pooled_norm.h"
#include "autograd/ops/reduce.h"

namespace restage {

BatchNormLayer::BatchNormLayer(int64_t channels, const Init& init) {
  weight.value = Tensor::full({channels}, 1, init.type);
  bias.value = Tensor::full({channels}, 0, init.type);
  running_mean = Tensor::full({channels}, 0, init.type);
  running_var = Tensor::full({channels}, 1, init.type);
}

Var BatchNormLayer::operator()(Context& ctx, const Var& x) {
  const ModuleScope path(scope);
  if (ctx.training) {
    BatchStatistics batch;
    const Var y = batch_norm(x, ctx.bind(weight), ctx.bind(bias), eps, &batch);
    update(batch);
    return y;
  }
  const Var one(Tensor::full({1}, 1, DType::f64, x.value.device()));
  const Var deviation = sqrt(add_scalar(Var(running_var.cast(DType::f64)), eps));
  const Var factor = mul(ctx.bind(weight), (one / deviation).value.cast(x.dtype()));
  return add(mul(x, factor), sub(ctx.bind(bias), mul(running_mean, factor)));
}

Var BatchNormLayer::pooled(Context& ctx, const Linear& map, const Var& x, Activation activation) {
  if (!ctx.training) {
    const Var y = (*this)(ctx, map(ctx, x));
    return max(activation == Activation::relu ? relu(y) : y, 1);
  }
  const ModuleScope path(scope);
  BatchStatistics batch;
  const Var w = reshape(ctx.bind(map.weight), {map.weight.value.size(0), -1});
  const Var y = pooled_norm(x, w, ctx.bind(map.bias), ctx.bind(weight), ctx.bind(bias), activation,
                            eps, &batch);
  update(batch);
  return y;
}

void BatchNormLayer::update(const BatchStatistics& batch) {
  // The running variance takes the unbiased one (n / (n - 1)).
  const double unbias = static_cast<double>(batch.count) / static_cast<double>(batch.count - 1);
  const auto blend = [&](const Tensor& old, const Tensor& fresh, double factor) {
    const Var kept = scale(Var(old.cast(DType::f64)), 1 - momentum);
    return (kept + scale(Var(fresh), momentum * factor)).value.cast(old.dtype());
  };
  running_mean = blend(running_mean, batch.mean, 1.0);
  running_var = blend(running_var, batch.variance, unbias);
}

void BatchNormLayer::visit(Fields& f) {
  f("weight", weight);
  f("bias", bias);
  f("running_mean", running_mean);
  f("running_var", running_var);
}

LayerNormLayer::LayerNormLayer(int64_t channels, const Init& init) {
  weight.value = Tensor::full({channels}, 1, init.type);
  bias.value = Tensor::full({channels}, 0, init.type);
}

Var LayerNormLayer::operator()(Context& ctx, const Var& x) const {
  const ModuleScope path(scope);
  return layer_norm(x, ctx.bind(weight), ctx.bind(bias));
}

void LayerNormLayer::visit(Fields& f) {
  f("weight", weight);
  f("bias", bias);
}

}  // namespace restage
