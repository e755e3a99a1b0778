#include "nn/layers/cross_attention.h"

#include "autograd/ops/cross_attention.h"
#include "autograd/ops/elementwise.h"

namespace restage {

GatedCrossAttention::GatedCrossAttention(int64_t channels, const Init& init)
    : q(channels, channels, init.sub("q"), true, 1),
      k(channels, channels, init.sub("k"), true, 1),
      v(channels, channels, init.sub("v"), true, 1),
      gamma(Tensor::zeros({1}, init.type)) {}

Var GatedCrossAttention::operator()(Context& ctx, const Var& target, const Var& pose,
                                    const Var& residual) const {
  const ModuleScope path(scope);
  const Var mixed = cross_attention(q(ctx, target), k(ctx, pose), v(ctx, pose));
  return residual + mixed * ctx.bind(gamma);
}

void GatedCrossAttention::visit(Fields& f) {
  f("gamma", gamma);
  f("q", q);
  f("k", k);
  f("v", v);
}

}  // namespace restage
