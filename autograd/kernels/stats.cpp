#include "autograd/kernels/stats.h"

#include <atomic>
#include <limits>

namespace restage {
namespace {
// Whole numbers, so that the sum does not depend on the order in which threads add.
std::atomic<int64_t> flops_done = 0, active_units = 0, all_units = 0;
}  // namespace

KernelStats take_kernel_stats() {
  const auto active = static_cast<double>(active_units.exchange(0));
  const auto all = static_cast<double>(all_units.exchange(0));
  return {static_cast<double>(flops_done.exchange(0)),
          all > 0 ? active / all : std::numeric_limits<double>::quiet_NaN()};
}

void count_flops(double flops) { flops_done += static_cast<int64_t>(flops); }

void count_units(int64_t active, int64_t all) {
  active_units += active;
  all_units += all;
}

}  // namespace restage
