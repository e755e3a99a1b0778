#include "train/rate_sweep.h"

#include <algorithm>
#include <cmath>

#include "autograd/base/error.h"
#include "autograd/base/interrupt.h"

namespace restage {
namespace {

constexpr double kKept = 0.9;       // of the mean, from one step to the next
constexpr double kDiverged = 4;     // times the least
constexpr size_t kFirstSteps = 10;  // whose mean is still of few losses: nothing is read off them
constexpr size_t kSlopeReach = 4;   // steps before and after, between which a slope is taken

/// How much losses differ from their mean, over the first `n` steps: a standard deviation.
double unrest(const RateSweep& sweep, size_t n) {
  double squares = 0;
  for (size_t i = 0; i < n; ++i) squares += std::pow(sweep.losses[i] - sweep.smoothed[i], 2);
  return std::sqrt(squares / static_cast<double>(n));
}

double named(const NamedValues& values, const std::string& name) {
  for (const auto& [key, value] : values)
    if (key == name) return value;
  throw Error("a step of this stage does not tell its " + name);
}

}  // namespace

void judge(RateSweep* sweep) {
  sweep->smoothed.clear();
  double mean = 0, weight = 0;
  for (const double loss : sweep->losses) {
    mean = kKept * mean + (1 - kKept) * loss;
    weight = kKept * weight + (1 - kKept);
    sweep->smoothed.push_back(mean / weight);
  }
  sweep->steepest = sweep->tenth_of_least = 0;
  const std::vector<double>&s = sweep->smoothed, &r = sweep->rates;
  if (s.size() < kFirstSteps + 2 * kSlopeReach) return;
  const auto begin = s.begin() + kFirstSteps;
  const auto least = std::min_element(begin, s.end());
  const auto n = static_cast<size_t>(least - s.begin());
  if (*std::max_element(begin, least + 1) - *least <= unrest(*sweep, n + 1)) return;
  double fall = 0;
  for (size_t i = kFirstSteps; i + kSlopeReach < s.size() && i <= n; ++i) {
    const double slope = s[i + kSlopeReach] - s[i - kSlopeReach];  // rates are evenly apart
    if (slope < fall) fall = slope, sweep->steepest = r[i];
  }
  sweep->tenth_of_least = r[n] / 10;
}

RateSweep sweep_rate(Stage& stage, MatmulPrecision precision) {
  RateSweep out;
  out.stage = stage.name();
  double least = 0;
  for (int64_t step = 0; step < stage.steps(); ++step) {
    throw_if_stopped();
    NamedValues values;
    try {
      const MatmulPrecisionScope scope(precision);
      values = stage.step(step);
    } catch (const NonFiniteError&) {
      break;
    }
    out.rates.push_back(named(values, "rate"));
    out.losses.push_back(named(values, "loss"));
    judge(&out);
    const double now = out.smoothed.back();
    least = step == 0 ? now : std::min(least, now);
    if (out.losses.size() > kFirstSteps && least > 0 && now > kDiverged * least) break;
  }
  return out;
}

}  // namespace restage
