// Scales and shifts of every channel that change from point to point: affine functions of a point's
// coordinates (SPAdaIN without its norm), or any (ElaIN without its norm and products).
#pragma once

#include "autograd/kernels/kernel.h"
#include "autograd/kernels/matmul.h"

namespace restage {

/// out[s, p, c] = act(f x + g) with f = scale[c] . mesh[s, p] + scale_bias[c] and g likewise of
/// shift. x [n, v, c], or [n, 1, c] for values that are the same at all points; mesh [n, v, 3];
/// scale, shift [c, 3]; biases [c].
struct ModulateArgs {
  const Tensor& x;
  const Tensor& mesh;
  const Tensor& scale;
  const Tensor& scale_bias;
  const Tensor& shift;
  const Tensor& shift_bias;
  Tensor& out;
  Activation activation;
};
/// Gradients of x (out), of the parameters, and of mesh where g_mesh is not null.
struct ModulateGradArgs {
  const Tensor& x;
  const Tensor& mesh;
  const Tensor& scale;
  const Tensor& scale_bias;
  const Tensor& shift;
  const Tensor& shift_bias;
  const Tensor& gy;
  Tensor& out;
  Tensor* g_mesh;
  Tensor& g_scale;
  Tensor& g_scale_bias;
  Tensor& g_shift;
  Tensor& g_shift_bias;
  Activation activation;
};

/// out = leaky(share (gamma unit + beta) + unit + (1 - share) x), leaky(y) being slope y for y of 0
/// or less. x, unit, gamma, beta [n, v, c]; share [n, c].
struct ElainArgs {
  const Tensor& x;
  const Tensor& unit;
  const Tensor& gamma;
  const Tensor& beta;
  const Tensor& share;
  Tensor& out;
  double slope;
};
/// Gradients of all five; out is that of x.
struct ElainGradArgs {
  const Tensor& x;
  const Tensor& unit;
  const Tensor& gamma;
  const Tensor& beta;
  const Tensor& share;
  const Tensor& gy;
  Tensor& out;
  Tensor& g_unit;
  Tensor& g_gamma;
  Tensor& g_beta;
  Tensor& g_share;
  double slope;
};

}  // namespace restage
