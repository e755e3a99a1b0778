#include "experiments/reproduce/converged.h"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>

#include "autograd/base/format.h"

namespace restage::reproduce {
namespace {

constexpr double kLastPart = 0.25, kStillLearns = 0.02;
constexpr size_t kFewestPoints = 5;

using tables::StageCurves;

/// The curve by which a stage is judged; null: it has none.
const tables::Curve* judged(const StageCurves& stage, const std::vector<std::string>& metrics,
                            std::string* figure) {
  const auto take = [&](const auto& one) {
    *figure = one.first;
    return &one.second;
  };
  for (const std::string& metric : metrics)
    for (const auto& one : stage.curves)
      if (one.first == metric) return take(one);
  return stage.curves.empty() ? nullptr : take(stage.curves.front());
}

/// The best value up to a part of the steps.
double best_until(const tables::Curve& curve, double part) {
  double best = std::numeric_limits<double>::infinity();
  for (const auto& [step, value] : curve)
    if (step <= part * curve.back().first) best = std::min(best, value);
  return best;
}

/// Of one stage over the seeds.
struct Gain {
  std::string figure;
  double before = 0, after = 0;
};

}  // namespace

std::string too_short(const tables::Results& results, const std::string& case_name,
                      const std::vector<std::string>& metrics) {
  std::map<std::string, Gain> gains;
  for (const tables::TrialResult& trial : results.trials) {
    if (trial.case_name != case_name || trial.state != tables::TrialState::done) continue;
    for (const auto& [stage, id] : trial.artifacts) {
      const auto found = trial.training.find(stage);
      if (found != trial.training.end() && found->second.steps == 0) continue;
      std::string figure;
      const tables::Curve* curve =
          found == trial.training.end() ? nullptr : judged(found->second, metrics, &figure);
      if (curve == nullptr) return "no curve of its " + stage + " stage was kept";
      if (curve->size() < kFewestPoints)
        return format("its %s stage has a curve of %zu points, and needs %zu", stage.c_str(),
                      curve->size(), kFewestPoints);
      Gain& gain = gains[stage];
      gain.figure = figure;
      gain.before += best_until(*curve, 1 - kLastPart);
      gain.after += best_until(*curve, 1);
    }
  }
  for (const auto& [stage, gain] : gains)
    if (gain.before - gain.after >= kStillLearns * gain.before)
      return format("the last quarter of its steps still lowers %s.%s by %.1f %%", stage.c_str(),
                    gain.figure.c_str(), 100 * (gain.before - gain.after) / gain.before);
  return "";
}

}  // namespace restage::reproduce
