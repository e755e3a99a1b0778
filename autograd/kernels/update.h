// What an optimiser does with gradients: their norm, updates in place.
#pragma once

#include "autograd/kernels/kernel.h"

namespace restage {

/// Adam as PyTorch's (spec 7); `step` counts from 1. In float64 the two differ by rounding alone.
/// In float32 1 - beta is computed in float32, where PyTorch rounds that of float64: with beta2 =
/// 0.999 v is 1.29e-5 of itself smaller than PyTorch's, and a step 6.5e-6 of itself longer.
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
