#include "autograd/ops/pooled_norm.h"

#include "autograd/kernels/pooled_norm.h"

namespace restage {

void PooledNorm::check(Inputs x) const {
  if (x[0].rank() != 3 || x[1].rank() != 2 || x[0].size(2) != x[1].size(1))
    shape_error(name, letters, x, "i must agree");
  for (size_t k = 2; k < 5; ++k)
    if (x[k].rank() != 1 || x[k].size(0) != x[1].size(0))
      shape_error(name, letters, x, "o must agree");
  if (x[0].size(0) * x[0].size(1) < 2)
    shape_error(name, letters, x, "needs more than one point in training");
  require_floats(name, letters, x);
}

Tensor PooledNorm::forward(Inputs x, Saved& saved) const {
  const int64_t n = x[0].size(0), v = x[0].size(1), o = x[1].size(0);
  const DType type = x[0].dtype();
  const Device device = x[0].device();
  Tensor y = Tensor::empty({n, o}, type, device), peak = Tensor::empty({n, o}, type, device);
  Tensor index = Tensor::empty({n, o}, DType::i32, device);
  Tensor centred = Tensor::empty(x[0].shape(), type, device);
  Tensor mean = Tensor::empty({o}, DType::f64, device);
  Tensor variance = Tensor::empty({o}, DType::f64, device);
  Tensor rstd = Tensor::empty({o}, DType::f64, device);
  launch(PooledNormArgs{x[0], x[1], x[2], x[3], x[4], y, centred, peak, index, mean, variance, rstd,
                        activation, eps});
  saved.keep({centred, x[1], x[3], rstd, peak, index, y});
  if (statistics != nullptr) *statistics = {mean, variance, n * v};
  return y;
}

Grads PooledNorm::backward(const Saved& s, const Tensor& gy, Needs needs) const {
  const Tensor& scale = s[2];
  Grads g{empty_like(s[0]), empty_like(s[1]), Tensor(), empty_like(scale), empty_like(scale)};
  launch(PooledNormGradArgs{s[0], s[1], scale, s[3], s[4], s[5], s[6], gy, g[0], g[1], g[3], g[4],
                            activation});
  if (needs[2]) g[2] = Tensor::zeros(scale.shape(), gy.dtype(), gy.device());
  return g;
}

}  // namespace restage
