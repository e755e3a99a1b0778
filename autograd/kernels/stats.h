// What the kernels did: counted by backends, read by whoever reports speed. Sums over all threads.
#pragma once

#include <cstdint>

namespace restage {

struct KernelStats {
  /// Of matrix products. A multiply-add counts as two; products that were left out do not count.
  double flops = 0;
  /// Shares of the units of neighbour attention that changed sign within their tile and so needed a
  /// product (1 in a tile that was done in full): behind the first ReLU (of offsets) and behind the
  /// second (of scores). NaN if no attention ran.
  double active_share = 0, active_score_share = 0;
};

/// What was counted since the last call.
KernelStats take_kernel_stats();

/// Backends call these to count.
void count_flops(double flops);
void count_units(int64_t active, int64_t all);
void count_score_units(int64_t active, int64_t all);

}  // namespace restage
