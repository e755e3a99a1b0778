// Reductions over the middle axis of [outer, n, inner]. Partial sums are cut by sizes and added in
// order, so bits do not depend on threads. f32 and f64.
#pragma once

#include "autograd/kernels/kernel.h"

namespace restage {

/// out[o, i] = sum over n of x[o, n, i].
struct SumArgs {
  static constexpr std::string_view name = "sum";
  const Tensor& x;
  Tensor& out;
  int64_t outer, n, inner;
};
/// out[o, i] = max over n; index (i32) = first n that attains it.
struct MaxArgs {
  static constexpr std::string_view name = "max";
  const Tensor& x;
  Tensor& out;
  Tensor& index;
  int64_t outer, n, inner;
};
/// out = 0, then out[o, index[o, i], i] = gy[o, i].
struct MaxGradArgs {
  static constexpr std::string_view name = "max_grad";
  const Tensor& gy;
  const Tensor& index;
  Tensor& out;
  int64_t outer, n, inner;
};
/// out = softmax of x over n (maximum subtracted).
struct SoftmaxArgs {
  static constexpr std::string_view name = "softmax";
  const Tensor& x;
  Tensor& out;
  int64_t outer, n, inner;
};
/// out = y * (gy - sum_n(gy * y)).
struct SoftmaxGradArgs {
  static constexpr std::string_view name = "softmax_grad";
  const Tensor& y;
  const Tensor& gy;
  Tensor& out;
  int64_t outer, n, inner;
};

}  // namespace restage
