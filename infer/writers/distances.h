// Distances between two surfaces over a whole clip, in constant memory.
#pragma once

#include <cstdint>
#include <vector>

namespace restage {

/// Metres. `p95`: exact to 0.01 mm, up to 0.2 m.
struct DistanceSummary {
  double mean = 0, p95 = 0, max = 0;
};

class Distances {
 public:
  void add(double metres);
  bool empty() const { return count_ == 0; }
  DistanceSummary summary() const;

 private:
  std::vector<uint64_t> histogram_;
  uint64_t count_ = 0;
  double sum_ = 0, max_ = 0;
};

}  // namespace restage
