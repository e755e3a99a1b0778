// Frames made on all threads, a few at a time, and used in order.
#pragma once

#include <algorithm>
#include <vector>

#include "autograd/base/interrupt.h"
#include "autograd/base/parallel.h"

namespace restage {

/// use(i, make(i)) for i = 0 ... n - 1; `make` runs on any thread, `use` on this one and in order.
/// Throws Interrupted between batches if the program was asked to stop.
template <class Value, class Make, class Use>
void in_batches(size_t n, const Make& make, const Use& use) {
  constexpr size_t kBatch = 16;
  std::vector<Value> values(kBatch);
  for (size_t begin = 0; begin < n; begin += kBatch) {
    throw_if_stopped();
    const size_t count = std::min(kBatch, n - begin);
    parallel_for(static_cast<int64_t>(count), 1, [&](int64_t from, int64_t to) {
      for (int64_t i = from; i < to; ++i) values[i] = make(begin + static_cast<size_t>(i));
    });
    for (size_t i = 0; i < count; ++i) use(begin + i, values[i]);
  }
}

}  // namespace restage
