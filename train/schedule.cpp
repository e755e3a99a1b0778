#include "train/schedule.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace restage {

bool increasing(const std::vector<int64_t>& steps) {
  for (size_t i = 1; i < steps.size(); ++i)
    if (steps[i] <= steps[i - 1]) return false;
  return true;
}

double learning_rate(const ScheduleConfig& config, int64_t step, int64_t steps) {
  double rate = config.rate;
  if (config.kind == ScheduleConfig::Kind::milestones) {
    for (const int64_t milestone : config.milestones)
      if (step >= milestone) rate *= config.factor;  // in turn, so that the bits are PyTorch's
  } else if (config.kind == ScheduleConfig::Kind::cosine) {
    const double length = static_cast<double>(std::max<int64_t>(steps - 1 - config.warmup, 1));
    const double done = std::clamp(static_cast<double>(step - config.warmup) / length, 0.0, 1.0);
    const double wave = 0.5 * (1.0 + std::cos(std::numbers::pi * done));
    rate *= config.final_fraction + (1.0 - config.final_fraction) * wave;
  }
  if (step < config.warmup)
    rate *= static_cast<double>(step + 1) / static_cast<double>(config.warmup);
  return rate;
}

}  // namespace restage
