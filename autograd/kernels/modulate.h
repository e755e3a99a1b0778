// A scale and a shift of every channel that are affine functions of a point's coordinates: SPAdaIN
// without its norm.
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

}  // namespace restage
