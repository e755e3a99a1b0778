// Reductions over the middle axis of [outer, n, inner]. Partial sums are cut by sizes and added in
// order, so bits do not depend on threads. f32 and f64.
#pragma once

#include "autograd/kernels/kernel.h"

namespace restage {

/// out[o, i] = sum over n of x[o, n, i].
struct SumArgs {
  const Tensor& x;
  Tensor& out;
  int64_t outer, n, inner;
};
/// out[o, i] = max over n; index (i32) = first n that attains it.
struct MaxArgs {
  const Tensor& x;
  Tensor& out;
  Tensor& index;
  int64_t outer, n, inner;
};
/// out = 0, then out[o, index[o, i], i] = gy[o, i].
struct MaxGradArgs {
  const Tensor& gy;
  const Tensor& index;
  Tensor& out;
  int64_t outer, n, inner;
};
/// out = softmax of x over n (maximum subtracted).
struct SoftmaxArgs {
  const Tensor& x;
  Tensor& out;
  int64_t outer, n, inner;
};
/// out = y * (gy - sum_n(gy * y)).
struct SoftmaxGradArgs {
  const Tensor& y;
  const Tensor& gy;
  Tensor& out;
  int64_t outer, n, inner;
};

}  // namespace restage
