#include "train/forecast.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include "autograd/kernels/stats.h"

namespace restage {
namespace {

constexpr int64_t kMost = 30;  // steps
constexpr double kEnough = 3;  // seconds

template <class Work>
double seconds_of(Work&& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

double StageForecast::seconds(int64_t validate_every) const {
  const int64_t validations = (steps + validate_every - 1) / validate_every;
  return before + per_step * static_cast<double>(steps) +
         validation * static_cast<double>(std::max<int64_t>(validations, 1));
}

int64_t count_parameters(const Stage& stage) {
  int64_t out = 0;
  for (const StateEntry& entry : stage.weights())
    if (entry.parameter != nullptr) out += entry.value->numel();
  return out;
}

StageForecast forecast(Stage& stage, MatmulPrecision precision, bool validate) {
  StageForecast out;
  out.stage = stage.name();
  out.parameters = count_parameters(stage);
  out.steps = stage.steps();
  if (out.steps == 0) return out;
  reset_peak_memory(stage.device());
  std::vector<double> times;
  double spent = 0;
  const auto step = [&](int64_t i) {
    const MatmulPrecisionScope scope(precision);
    return seconds_of([&] { stage.step(i); });
  };
  const double first = step(0);
  if (first > kEnough) times.push_back(first);
  for (int64_t i = 1; i <= kMost && first <= kEnough && spent < kEnough; ++i) {
    times.push_back(step(i));
    spent += times.back();
  }
  std::nth_element(times.begin(), times.begin() + std::ssize(times) / 2, times.end());
  out.per_step = times[times.size() / 2];
  out.before = std::max(0.0, first - out.per_step);
  if (validate) out.validation = seconds_of([&] { stage.measure(); });
  out.memory = memory_stats(stage.device()).peak;
  return out;
}

}  // namespace restage
