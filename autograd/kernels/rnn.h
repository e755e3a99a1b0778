// Recurrences. A GRU layer (PyTorch's equations, spec 3.2), gates stacked r, z, n. Sums are ordered
// as in matmul.h: a step alone has the same bits as that step in a sequence, and a row alone the
// same bits as that row in a batch.
#pragma once

#include "autograd/kernels/kernel.h"
#include "autograd/kernels/matmul_precision.h"

namespace restage {

/// All steps of one layer. x [t, n, i], h0 [n, h], w_ih [3h, i], w_hh [3h, h], b_ih and b_hh [3h]
/// -> out [t, n, h]; gates [t, n, 4h], or null, keeps r, z, n and W_hn h + b_hn of every step for
/// the backward pass.
struct GruArgs {
  const Tensor& x;
  const Tensor& h0;
  const Tensor& w_ih;
  const Tensor& w_hh;
  const Tensor& b_ih;
  const Tensor& b_hh;
  Tensor& out;
  Tensor* gates;
  /// Of the products with the inputs of all steps.
  MatmulPrecision precision = MatmulPrecision::float32;
};
/// gy [t, n, h] and y = out of GruArgs -> g_gi [t, n, 3h], g_gh [t, n, 3h] (gradients of W_i x +
/// b_i and of W_h h + b_h), out [n, h] = gradient of h0.
struct GruGradArgs {
  const Tensor& gates;
  const Tensor& y;
  const Tensor& h0;
  const Tensor& w_hh;
  const Tensor& gy;
  Tensor& g_gi;
  Tensor& g_gh;
  Tensor& out;
};

/// y_t = a_t y_(t-1) + b_t, number by number: a, b [n, t, m], first [n, m] -> out [n, t, m].
struct RecurrenceArgs {
  const Tensor& a;
  const Tensor& b;
  const Tensor& first;
  Tensor& out;
};
/// gy [n, t, m] and y = out of RecurrenceArgs -> g_a, out [n, t, m] = gradient of b, g_first [n,
/// m].
struct RecurrenceGradArgs {
  const Tensor& a;
  const Tensor& y;
  const Tensor& first;
  const Tensor& gy;
  Tensor& g_a;
  Tensor& g_first;
  Tensor& out;
};

}  // namespace restage
