// Normalisation over the middle axis of [outer, n, inner]: batch norm (1, rows, channels), instance
// norm (samples, points, channels) and layer norm (rows, channels, 1) are the same kernel.
#pragma once

#include "autograd/kernels/kernel.h"

namespace restage {

enum class Affine {
  none,
  inner,
  middle
};  ///< the axis along which scale and shift run; middle needs inner = 1

/// out = (x - mean) * rstd * scale + shift, biased variance; mean, rstd [outer, inner] are outputs,
/// always f64: over few rows the gradient all but cancels and needs them exactly.
struct NormArgs {
  const Tensor& x;
  const Tensor* scale;
  const Tensor* shift;
  Tensor& out;
  Tensor& mean;
  Tensor& rstd;
  int64_t outer, n, inner;
  Affine affine;
  double eps;
};
/// Gradients of all three inputs; out is the gradient of x. g_scale, g_shift null when not wanted.
struct NormGradArgs {
  const Tensor& x;
  const Tensor* scale;
  const Tensor& mean;
  const Tensor& rstd;
  const Tensor& gy;
  Tensor& out;
  Tensor* g_scale;
  Tensor* g_shift;
  int64_t outer, n, inner;
  Affine affine;
};

}  // namespace restage
