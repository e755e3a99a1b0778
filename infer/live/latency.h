// How long frames took: a histogram, whose memory is the same for a second and for a week.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace restage::live {

class LatencyMeter {
 public:
  void add(double milliseconds);
  int64_t count() const { return count_; }
  /// The least time within which a share (0 to 1) of all frames was answered, milliseconds, to 1 %;
  /// never more than longest(). 0 without frames.
  double quantile(double share) const;
  double longest() const { return longest_; }  ///< exact

 private:
  // Bin 0 ends at kShortest; each further one is 1 % wider. The last holds all that is longer.
  static constexpr double kShortest = 0.01, kWider = 1.01;  // milliseconds
  static constexpr size_t kBins = 1700;                     // up to 200 s
  std::array<int64_t, kBins> bins_{};
  int64_t count_ = 0;
  double longest_ = 0;
};

}  // namespace restage::live
