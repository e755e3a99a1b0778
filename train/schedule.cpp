#include "train/schedule.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace restage {
namespace {

constexpr int64_t kLongestPeriod = int64_t{1} << 60;

/// From 1 to 0 while `done` goes from 0 to 1.
double half_cosine(double done) { return 0.5 * (1.0 + std::cos(std::numbers::pi * done)); }

/// How much of the period in which step `at` lies is done.
double done_of_period(const ScheduleConfig& config, int64_t at) {
  int64_t length = config.period;
  if (config.period_factor == 1) {
    at %= length;
  } else {
    while (at >= length) {
      at -= length;
      // No training is so long that a longer period would matter.
      length = length > kLongestPeriod / config.period_factor ? kLongestPeriod
                                                              : length * config.period_factor;
    }
  }
  return static_cast<double>(at) / static_cast<double>(length);
}

/// The share of the rate in a step of a cycle (PyTorch's OneCycleLR).
double share_of_cycle(const ScheduleConfig& config, int64_t step, int64_t steps) {
  const auto at = static_cast<double>(step), last = static_cast<double>(steps - 1);
  const double top = std::max(config.rise * static_cast<double>(steps) - 1, 0.0);
  if (at <= top && top > 0) return 1 + (config.initial_fraction - 1) * half_cosine(at / top);
  const double done = last > top ? std::min((at - top) / (last - top), 1.0) : 1.0;
  return config.final_fraction + (1 - config.final_fraction) * half_cosine(done);
}

}  // namespace

bool increasing(const std::vector<int64_t>& steps) {
  for (size_t i = 1; i < steps.size(); ++i)
    if (steps[i] <= steps[i - 1]) return false;
  return true;
}

double learning_rate(const ScheduleConfig& config, int64_t step, int64_t steps) {
  using Kind = ScheduleConfig::Kind;
  double rate = config.rate;
  const double length = static_cast<double>(std::max<int64_t>(steps - 1 - config.warmup, 1));
  const double done = std::clamp(static_cast<double>(step - config.warmup) / length, 0.0, 1.0);
  const auto falling = [&](double left) {  // from 1 to 0
    return config.final_fraction + (1.0 - config.final_fraction) * left;
  };
  switch (config.kind) {
    case Kind::constant:
      break;
    case Kind::milestones:
      for (const int64_t milestone : config.milestones)
        if (step >= milestone) rate *= config.factor;  // in turn, so that the bits are PyTorch's
      break;
    case Kind::cosine:
      rate *= falling(half_cosine(done));
      break;
    case Kind::linear:
      rate *= falling(1 - done);
      break;
    case Kind::polynomial:
      rate *= falling(std::pow(1 - done, config.power));
      break;
    case Kind::exponential:
      rate *= std::pow(config.final_fraction, done);
      break;
    case Kind::restarts:
      rate *=
          falling(half_cosine(done_of_period(config, std::max<int64_t>(step - config.warmup, 0))));
      break;
    case Kind::one_cycle:
      rate *= share_of_cycle(config, step, steps);
      break;
  }
  if (step < config.warmup)
    rate *= static_cast<double>(step + 1) / static_cast<double>(config.warmup);
  return rate;
}

}  // namespace restage
