// Empties the caches between repetitions, so that weights have to come from memory.
#pragma once

#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "autograd/base/parallel.h"

namespace restage::bench {

/// As large as the last cache, at least 64 and at most 512 MiB. LibTorch's program does the same.
inline int64_t flush_bytes() {
  const int64_t l3 = sysconf(_SC_LEVEL3_CACHE_SIZE);
  return std::clamp<int64_t>(l3, 64 << 20, 512 << 20);
}

class CacheFlush {
 public:
  /// Without `on`, run() is not to be called and no memory is taken.
  explicit CacheFlush(bool on) : buffer_(on ? static_cast<size_t>(flush_bytes() / 8) : 0) {}
  /// Reads and writes the whole buffer, all threads a part of it.
  void run() {
    const auto n = static_cast<int64_t>(buffer_.size());
    parallel_for(n, (n + threads() - 1) / threads(), [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) buffer_[static_cast<size_t>(i)] += 1;
    });
  }

 private:
  std::vector<int64_t> buffer_;
};

}  // namespace restage::bench
