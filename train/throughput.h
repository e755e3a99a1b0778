// How fast a training runs: examples per second, and what share of this machine's matrix product
// rate the steps reach.
#pragma once

#include "train/stage.h"

namespace restage {

/// Operations per second of a large float32 matrix product with the threads in use: the best of a
/// few, about 50 ms. Measured once per process.
double product_rate();

/// Sums over the steps of one stage; validation and checkpoints do not count.
class Throughput {
 public:
  /// A step of `examples` took `seconds` and did `flops`.
  void add(int64_t examples, double seconds, double flops);
  double seconds() const { return seconds_; }
  /// examples_per_second and peak_share: for people, never for metrics.jsonl, whose numbers repeat.
  NamedValues values() const;

 private:
  int64_t examples_ = 0;
  double seconds_ = 0, flops_ = 0;
};

}  // namespace restage
