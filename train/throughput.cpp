#include "train/throughput.h"

#include <algorithm>
#include <chrono>

#include "autograd/kernels/stats.h"
#include "autograd/ops/linear.h"

namespace restage {

double product_rate() {
  static const double rate = [] {
    constexpr int64_t n = 1024;
    const Var a(Tensor::full({n, n}, 0.5)), b(Tensor::full({n, n}, 0.25));
    double best = 0;
    for (int i = 0; i < 5; ++i) {
      const auto start = std::chrono::steady_clock::now();
      matmul(a, b);
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
      best = std::max(best, 2.0 * n * n * n / std::max(took.count(), 1e-9));
    }
    take_kernel_stats();
    return best;
  }();
  return rate;
}

void Throughput::add(int64_t examples, double seconds, double flops) {
  examples_ += examples;
  seconds_ += seconds;
  flops_ += flops;
}

NamedValues Throughput::values() const {
  if (seconds_ <= 0) return {};
  return {{"examples_per_second", static_cast<double>(examples_) / seconds_},
          {"peak_share", flops_ / seconds_ / product_rate()}};
}

}  // namespace restage
