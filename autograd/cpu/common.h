// Small helpers of the CPU kernels.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>

#include "autograd/base/error.h"
#include "autograd/base/parallel.h"
#include "autograd/tensor/tensor.h"

namespace restage::cpu {

/// Pieces of element-wise loops: large enough to hide the hand-over, small enough for L2.
inline constexpr int64_t kGrain = 1 << 14;

/// Calls f(T{}) with T = float or double.
template <class F>
void dispatch(DType type, F&& f) {
  if (type == DType::f32) {
    f(float{});
  } else if (type == DType::f64) {
    f(double{});
  } else {
    throw Error(std::string("kernel has no variant for ") + name_of(type));
  }
}

/// Rows per piece so that a piece has about kGrain numbers.
inline int64_t row_grain(int64_t row_size) {
  return std::max<int64_t>(1, kGrain / std::max<int64_t>(1, row_size));
}

}  // namespace restage::cpu
