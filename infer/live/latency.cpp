#include "infer/live/latency.h"

#include <algorithm>
#include <cmath>

namespace restage::live {

void LatencyMeter::add(double milliseconds) {
  const double bin =
      std::ceil(std::log(std::max(milliseconds, kShortest) / kShortest) / std::log(kWider));
  ++bins_[std::min(static_cast<size_t>(std::max(bin, 0.0)), kBins - 1)];
  ++count_;
  longest_ = std::max(longest_, milliseconds);
}

double LatencyMeter::quantile(double share) const {
  const auto wanted =
      std::max<int64_t>(1, static_cast<int64_t>(std::ceil(share * static_cast<double>(count_))));
  int64_t seen = 0;
  for (size_t bin = 0; bin < kBins; ++bin) {
    seen += bins_[bin];
    if (seen >= wanted && count_ > 0)
      return bin + 1 == kBins ? longest_
                              : std::min(longest_, kShortest * std::pow(kWider, double(bin)));
  }
  return 0;
}

}  // namespace restage::live
