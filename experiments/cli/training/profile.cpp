#include "experiments/cli/training/profile.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "autograd/base/format.h"

namespace restage::cli {
namespace {

constexpr std::array<std::pair<const char*, double>, 4> kColumns = {
    {{"p50", 0.5}, {"p95", 0.95}, {"p99", 0.99}, {"max", 1.0}}};

/// The smallest value that at least the share `p` of all do not exceed, in milliseconds.
double percentile(const std::vector<double>& sorted, double p) {
  if (sorted.empty()) return 0;
  const double rank = std::ceil(p * static_cast<double>(sorted.size()));
  return 1e3 * sorted[static_cast<size_t>(std::max(rank, 1.0)) - 1];
}

}  // namespace

Json Profile::json() const {
  Json out = Json::object();
  for (size_t i = 0; i < parts_.size(); ++i) {
    std::vector<double> sorted = seconds_[i];
    std::sort(sorted.begin(), sorted.end());
    for (const auto& [name, p] : kColumns) out[parts_[i]][name] = percentile(sorted, p);
  }
  return out;
}

std::vector<std::string> Profile::lines() const {
  const Json table = json();
  std::vector<std::string> out = {"ms a frame        p50      p95      p99      max"};
  for (const auto& [part, row] : table.items()) {
    std::string line = format("%-12s", part.c_str());
    for (const auto& [name, p] : kColumns) line += format("%9.2f", row[name].get<double>());
    out.push_back(line);
  }
  return out;
}

}  // namespace restage::cli
