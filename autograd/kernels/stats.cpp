#include "autograd/kernels/stats.h"

#include <atomic>
#include <limits>

namespace restage {
namespace {
// Whole numbers, so that the sum does not depend on the order in which threads add.
std::atomic<int64_t> flops_done = 0;

struct Units {
  std::atomic<int64_t> active = 0, all = 0;
  void add(int64_t some, int64_t every) {
    active += some;
    all += every;
  }
  double take() {
    const auto some = static_cast<double>(active.exchange(0));
    const auto every = static_cast<double>(all.exchange(0));
    return every > 0 ? some / every : std::numeric_limits<double>::quiet_NaN();
  }
};
Units units, score_units;
}  // namespace

KernelStats take_kernel_stats() {
  return {static_cast<double>(flops_done.exchange(0)), units.take(), score_units.take()};
}

void count_flops(double flops) { flops_done += static_cast<int64_t>(flops); }
void count_units(int64_t active, int64_t all) { units.add(active, all); }
void count_score_units(int64_t active, int64_t all) { score_units.add(active, all); }

}  // namespace restage
