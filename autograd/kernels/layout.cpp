#include "autograd/kernels/layout.h"

#include <algorithm>

namespace restage {

bool index_within(const Tensor& index, int64_t limit) {
  const int32_t* at = index.data<int32_t>();
  return std::all_of(at, at + index.numel(), [&](int32_t i) { return i >= 0 && i < limit; });
}

}  // namespace restage
