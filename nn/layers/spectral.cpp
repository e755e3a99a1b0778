#include "nn/layers/spectral.h"

#include <cmath>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/linear.h"
#include "autograd/ops/reduce.h"

namespace restage {
namespace {

/// x over its length, to which 1e-12 is added.
Tensor unit(const Tensor& x) {
  const Var length = add_scalar(sqrt(sum_all(square(Var(x)))), 1e-12);
  return div(Var(x), length).value;
}

/// A random unit vector.
Tensor direction(int64_t size, const Init& init, const char* name) {
  return unit(init.uniform({size}, 1, name));
}

}  // namespace

SpectralLinear::SpectralLinear(int64_t in, int64_t out, const Init& init, bool with_bias)
    : with_bias_(with_bias) {
  // The start of 3D-CoreNet's program does not reach these on a GPU, where it was trained.
  weight.value = init.begun(true, Start::pytorch).weight({out, in, 1}, in, out);
  if (with_bias) bias.value = init.bias(in, out);
  u = direction(out, init, "u");
  v = direction(in, init, "v");
}

Var SpectralLinear::operator()(Context& ctx, const Var& x) {
  const ModuleScope path(scope);
  const int64_t out = weight.value.size(0), in = weight.value.size(1);
  const Var w = reshape(ctx.bind(weight), {out, in});
  if (ctx.training) {
    const Var plain = w.detach();
    v = unit(matmul(reshape(Var(u), {1, out}), plain).value.reshape({in}));
    u = unit(matmul(plain, reshape(Var(v), {in, 1})).value.reshape({out}));
  }
  const Var sigma = sum_all(matmul(w, reshape(Var(v), {in, 1})) * reshape(Var(u), {out, 1}));
  const Var scaled = w / sigma;
  return with_bias_ ? linear(x, scaled, ctx.bind(bias)) : linear(x, scaled);
}

void SpectralLinear::visit(Fields& f) {
  if (with_bias_) f("bias", bias);
  f("weight_orig", weight);
  f("weight_u", u);
  f("weight_v", v);
}

}  // namespace restage
