// SPAdaIN's second half (Wang et al., CVPR 2020): features scaled and shifted by functions of
// coordinates.
#pragma once

#include "autograd/kernels/modulate.h"
#include "autograd/tape/tape.h"

namespace restage {

/// y [n, v, c] = act((A m + a) * x + (B m + b)) at each point, with its coordinates m. x may have
/// one row for all points of an item. One pass over x, where its parts take five and keep four
/// tensors of its size.
struct Modulate {
  static constexpr const char* name = "modulate";
  static constexpr const char* letters =
      "x[n, v or 1, c], m[n, v, 3], A[c, 3], a[c], B[c, 3], b[c]";
  Activation activation = Activation::none;
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

inline Var modulate(const Var& x, const Var& mesh, const Var& scale, const Var& scale_bias,
                    const Var& shift, const Var& shift_bias,
                    Activation activation = Activation::none) {
  return call(Modulate{activation}, {x, mesh, scale, scale_bias, shift, shift_bias});
}

}  // namespace restage
