// What an optimiser does with gradients: their norm, updates in place.
#pragma once

#include "autograd/kernels/kernel.h"

namespace restage {

/// Adam exactly as PyTorch's (spec 7); `step` counts from 1.
struct AdamArgs {
  const Tensor& gradient;
  Tensor& out;  ///< the parameter
  Tensor& m;
  Tensor& v;
  double lr, beta1, beta2, eps, weight_decay, gradient_scale;
  int64_t step;
};

/// out = keep * out + add * x, of one shape.
struct MixArgs {
  const Tensor& x;
  Tensor& out;
  double keep, add;
};

/// out [1], f64: the sum of the squares of x, in double, in an order that the size alone decides.
struct SquaredNormArgs {
  const Tensor& x;
  Tensor& out;
};

}  // namespace restage
