// A linear map per point, batch norm and the maximum over the points of a cloud, in one. The
// product [n, v, o], by far the largest tensor of such a layer, is never written, only its maxima
// are.
#pragma once

#include "autograd/kernels/kernel.h"
#include "autograd/kernels/matmul.h"

namespace restage {

/// y[s, p] = act(scale * xhat + shift), xhat = (z - mean) * rstd, z = x W^T + b; mean and biased
/// variance of z are over all n * v points. out [n, o] = max over p of y, at point index [n, o]
/// (the first of equal ones). `peak` [n, o] is xhat there; `centred` [n, v, i] is x less its mean
/// over all points; mean, variance, rstd [o] are f64. x [n, v, i], weight [o, i]; bias, scale,
/// shift [o].
struct PooledNormArgs {
  const Tensor& x;
  const Tensor& weight;
  const Tensor& bias;
  const Tensor& scale;
  const Tensor& shift;
  Tensor& out;
  Tensor& centred;
  Tensor& peak;
  Tensor& index;
  Tensor& mean;
  Tensor& variance;
  Tensor& rstd;
  Activation activation;
  double eps;
};
/// Gradients of x (out), weight, scale and shift; the gradient of the bias is zero. y: the forward
/// result.
struct PooledNormGradArgs {
  const Tensor& centred;
  const Tensor& weight;
  const Tensor& scale;
  const Tensor& rstd;
  const Tensor& peak;
  const Tensor& index;
  const Tensor& y;
  const Tensor& gy;
  Tensor& out;
  Tensor& g_weight;
  Tensor& g_scale;
  Tensor& g_shift;
  Activation activation;
};

}  // namespace restage
