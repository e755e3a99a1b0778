// What the kernels did: counted by backends, read by whoever reports speed. Sums over all threads.
#pragma once

#include <cstdint>

namespace restage {

struct KernelStats {
  double flops =
      0;  ///< of matrix products, a multiply-add is two; what was left out is not counted
  /// Shares of the units of neighbour attention that changed sign within their tile and so needed a
  /// product (1 in a tile that was done in full): behind the first ReLU, on offsets, and the
  /// second, on scores. NaN if no attention ran.
  double active_share = 0, active_score_share = 0;
};

/// Since the last call.
KernelStats take_kernel_stats();

/// For backends.
void count_flops(double flops);
void count_units(int64_t active, int64_t all);
void count_score_units(int64_t active, int64_t all);

}  // namespace restage
