// Features scaled and shifted from point to point: the second halves of SPAdaIN (Wang et al., CVPR
// 2020) and of ElaIN (3D-CoreNet, Song et al., NeurIPS 2021, section 3.3).
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

/// y [n, v, c] = leaky(s (g u + b) + u + (1 - s) x): x and u, which is x normalised, in the style
/// of g and b, in shares s for each channel; leaky(y) is slope y for y of 0 or less. One pass over
/// each, where its parts take seven.
struct ElainMix {
  static constexpr const char* name = "elain";
  static constexpr const char* letters = "x[n, v, c], u[n, v, c], g[n, v, c], b[n, v, c], s[n, c]";
  double slope = 1;
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

inline Var elain(const Var& x, const Var& unit, const Var& gamma, const Var& beta, const Var& share,
                 double slope = 1) {
  return call(ElainMix{slope}, {x, unit, gamma, beta, share});
}

inline Var modulate(const Var& x, const Var& mesh, const Var& scale, const Var& scale_bias,
                    const Var& shift, const Var& shift_bias,
                    Activation activation = Activation::none) {
  return call(Modulate{activation}, {x, mesh, scale, scale_bias, shift, shift_bias});
}

}  // namespace restage
