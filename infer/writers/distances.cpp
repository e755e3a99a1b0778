#include "infer/writers/distances.h"

#include <algorithm>

namespace restage {
namespace {

constexpr double kBin = 1e-5;    // metres
constexpr size_t kBins = 20000;  // the last one holds all that is further

}  // namespace

void Distances::add(double metres) {
  if (histogram_.empty()) histogram_.resize(kBins + 1);
  sum_ += metres;
  max_ = std::max(max_, metres);
  ++count_;
  const bool near = metres < kBin * static_cast<double>(kBins);  // not so of NaN
  ++histogram_[near ? static_cast<size_t>(metres / kBin) : kBins];
}

DistanceSummary Distances::summary() const {
  if (count_ == 0) return {};
  DistanceSummary result{sum_ / static_cast<double>(count_), 0, max_};
  uint64_t seen = 0;
  for (size_t bin = 0; bin < histogram_.size(); ++bin) {
    seen += histogram_[bin];
    if (static_cast<double>(seen) < 0.95 * static_cast<double>(count_)) continue;
    result.p95 = std::min(max_, static_cast<double>(bin + 1) * kBin);
    break;
  }
  return result;
}

}  // namespace restage
