#include "nn/layers/cross_attention.h"

#include "autograd/ops/cross_attention.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"

namespace restage {

GatedCrossAttention::GatedCrossAttention(int64_t channels, const Init& init)
    : q(channels, channels, init.sub("q"), true, 1),
      k(channels, channels, init.sub("k"), true, 1),
      v(channels, channels, init.sub("v"), true, 1),
      gamma(Tensor::zeros({1}, init.type)) {}

Var GatedCrossAttention::operator()(Context& ctx, const Var& target, const Var& pose,
                                    const Var& residual) const {
  const ModuleScope path(scope);
  // All queries get the same from one key, so one of them stands for all.
  const Var asking = pose.size(1) == 1 ? slice(target, 1, 0, 1) : target;
  const Var queries = repeat_items(q(ctx, asking), pose.size(0) / target.size(0));
  const Var mixed = cross_attention(queries, k(ctx, pose), v(ctx, pose));
  return residual + mixed * ctx.bind(gamma);
}

void GatedCrossAttention::visit(Fields& f) {
  f("gamma", gamma);
  f("q", q);
  f("k", k);
  f("v", v);
}

}  // namespace restage
