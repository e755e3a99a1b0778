// Recurrent layers (spec 3.2).
#pragma once

#include "autograd/kernels/matmul_precision.h"
#include "autograd/tape/tape.h"

namespace restage {

/// One GRU layer over a whole sequence, time first, PyTorch's equations and gate order r, z, n.
/// Input products of all steps are one matrix product, forward and backward.
struct Gru {
  static constexpr const char* name = "gru";
  static constexpr const char* letters =
      "x[t, n, i], h0[n, h], w_ih[3h, i], w_hh[3h, h], b_ih[3h], b_hh[3h]";
  /// Precision of the products over all steps at once, forward and backward; see LinearOp.
  MatmulPrecision precision = matmul_precision();
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

/// y_t = a_t y_(t-1) + b_t, number by number, y_0 = `first`: a filter whose gain may change. Rows
/// first, unlike Gru.
struct Recurrence {
  static constexpr const char* name = "recurrence";
  static constexpr const char* letters = "a[n, t, m], b[n, t, m], first[n, m]";
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};
inline Var recurrence(const Var& a, const Var& b, const Var& first) {
  return call(Recurrence{}, {a, b, first});
}

/// y [t, n, h]: hidden states of all steps.
inline Var gru(const Var& x, const Var& h0, const Var& w_ih, const Var& w_hh, const Var& b_ih,
               const Var& b_hh) {
  return call(Gru{}, {x, h0, w_ih, w_hh, b_ih, b_hh});
}

}  // namespace restage
