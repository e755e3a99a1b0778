// Matrix products. Each output element is one chain of multiply-adds over k in order (per block of
// 256), whatever its position, so results do not depend on threads or on the other rows of a batch:
// one row alone, which is computed in another way, has the same bits.
//
// In bfloat16 (kernels/matmul_precision.h) an element is summed over steps of 32 terms: in each,
// one chain of multiply-adds over the even terms, one over the odd ones, and their sum is added to
// the element. Subnormal numbers count as zero. This is what Intel's matrix unit (AMX, TDPBF16PS)
// does; other processors compute the same bits.
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
  /// float64 operands, and products of fewer than kLeastTerms terms, stay as they are: the latter
  /// are bound by memory, and most of them take in coordinates, which need their digits.
  MatmulPrecision precision = MatmulPrecision::float32;
  static constexpr int64_t kLeastTerms = 32;
};

}  // namespace restage
