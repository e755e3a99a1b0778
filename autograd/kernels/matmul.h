// Matrix products. Each output element is one chain of multiply-adds over k in order (per block of
// 256), whatever its position, so results do not depend on threads or on the other rows of a batch:
// one row alone, which is computed in another way, has the same bits.
#pragma once

#include "autograd/kernels/kernel.h"
#include "autograd/kernels/matmul_precision.h"

namespace restage {

enum class Activation { none, relu };

/// out[b] = act(op(a[b]) op(bm[b]) + bias) (+ out if accumulate); a [batch?, m, k], bm [batch?, k,
/// n], both transposed on request; a matrix without batch axis is shared. bias [n] or null.
struct MatmulArgs {
  const Tensor& a;
  const Tensor& b;
  Tensor& out;
  bool transpose_a = false;
  bool transpose_b = false;
  const Tensor* bias = nullptr;
  Activation activation = Activation::none;
  bool accumulate = false;
  /// Of a GPU's products. float64 operands are never rounded, nor are the operands of products of
  /// fewer than kLeastTerms terms: such products are bound by memory, and most of them take in
  /// coordinates, which need their digits.
  MatmulPrecision precision = MatmulPrecision::float32;
  static constexpr int64_t kLeastTerms = 32;
};

}  // namespace restage
