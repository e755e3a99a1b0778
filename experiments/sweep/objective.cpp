#include "experiments/sweep/objective.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "autograd/base/nearest.h"
#include "autograd/base/words.h"
#include "nn/metrics/metrics.h"
#include "train/stages/registry.h"

namespace restage::sweep {
namespace {

using tables::TrialState;

std::string head(const std::string& metric) { return metric.substr(0, metric.find('.')); }
std::string tail(const std::string& metric) { return metric.substr(metric.find('.') + 1); }

const StageType* stage_named(const std::string& name) {
  for (const StageType& type : stage_types())
    if (type.name == name) return &type;
  return nullptr;
}

/// The figures of the stages with these names, and the metrics of these sets.
std::vector<std::string> known_metrics(const std::vector<std::string>& stages,
                                       const std::vector<std::string>& sets) {
  std::vector<std::string> out;
  for (const std::string& stage : stages)
    if (const StageType* type = stage_named(stage))
      for (const std::string& figure : type->figures) out.push_back(cat(stage, ".", figure));
  for (const std::string& set : sets)
    for (const metrics::Metric& metric : metrics::recorded())
      out.push_back(cat(set, ".", metric.name));
  return out;
}

/// Stages that some trial makes an artifact of, in the order of training.
template <class Trials, class Name>
std::vector<std::string> stages_made(const Trials& trials, const Name& name) {
  std::vector<std::string> out;
  for (const auto& trial : trials)
    for (const auto& artifact : trial.artifacts)
      if (std::find(out.begin(), out.end(), name(artifact)) == out.end())
        out.push_back(name(artifact));
  return out;
}

std::vector<std::string> sets_measured(const Evaluate& evaluate) {
  return evaluate.benchmark.empty()
             ? std::vector<std::string>{"clouds", "true_skeletons", "true_poses"}
             : evaluate.sets;
}

void need_metric(const std::string& metric, const std::vector<std::string>& known,
                 const std::string& place) {
  if (std::find(known.begin(), known.end(), metric) != known.end()) return;
  const std::string close = nearest(metric, known);
  throw InputError(place, "no trial measures " + in_quotes(metric),
                   close.empty() ? "use one of " + cut_list(known, 120)
                                 : "did you mean " + in_quotes(close) + "?");
}

std::vector<std::string> metrics_of(const SweepDir& dir) {
  return known_metrics(stages_made(dir.trials, [](const auto& a) { return a.first; }),
                       sets_measured(dir.evaluate));
}

}  // namespace

bool is_of_training(const std::string& metric) { return stage_named(head(metric)) != nullptr; }

void check_metric(const std::string& metric, const ConfigPlace& place, const SweepPlan& plan,
                  const Evaluate& evaluate) {
  need_metric(metric,
              known_metrics(stages_made(plan.trials, [](const auto& a) { return a.stage; }),
                            sets_measured(evaluate)),
              place.text());
}

std::string main_metric(const SweepDir& dir) {
  if (dir.search && !dir.search->metric.empty()) return dir.search->metric;
  if (dir.early_stop) return dir.early_stop->metric;
  std::string last;
  for (const std::string& stage : stages_made(dir.trials, [](const auto& a) { return a.first; }))
    if (const StageType* type = stage_named(stage); type != nullptr && !type->figures.empty())
      last = cat(stage, ".", type->figures[0]);
  // Pictures of sweeps are about motion, the stage before surfaces.
  const std::vector<std::string> known = metrics_of(dir);
  const std::string motion = "motion.pa_mpjpe";
  return std::find(known.begin(), known.end(), motion) != known.end() ? motion : last;
}

std::string main_metric(const SweepDir& dir, const std::string& wanted) {
  if (wanted.empty()) return main_metric(dir);
  if (dir.trials.empty()) return wanted;  // of a search that has asked for nothing yet
  need_metric(wanted, metrics_of(dir), "");
  return wanted;
}

std::string store_of(const SweepDir& dir) {
  namespace fs = std::filesystem;
  return (fs::path(dir.path) / dir.directory / dir.store).lexically_normal().string();
}

Curve curve_of(const SweepDir& dir, const TrialEntry& trial,
               const std::optional<tables::TrialResult>& result, const std::string& metric) {
  if (!is_of_training(metric)) return {};
  for (const auto& [stage, id] : trial.artifacts)
    if (stage == head(metric)) {
      Curve found = read_curve(Store(store_of(dir)).metrics({stage, id, ""}), tail(metric));
      if (!found.empty()) return found;
    }
  Curve out;
  if (!result) return out;
  if (const auto stage = result->training.find(head(metric)); stage != result->training.end())
    for (const auto& [figure, points] : stage->second.curves)
      if (figure == tail(metric))
        for (const auto& [step, value] : points) out.push_back({static_cast<int64_t>(step), value});
  return out;
}

std::optional<double> value_of(const SweepDir& dir, const TrialEntry& trial,
                               const std::optional<tables::TrialResult>& result,
                               const std::string& metric) {
  if (!result) return std::nullopt;
  if (result->told) return *result->told;
  if (result->state == TrialState::failed) return INFINITY;
  if (!is_over(dir, *result)) return std::nullopt;
  if (is_of_training(metric)) {
    const Curve curve = curve_of(dir, trial, result, metric);
    return curve.empty() ? INFINITY : curve.back().value;
  }
  for (const auto& [set, scores] : result->sets)
    if (set == head(metric))
      if (const auto found = scores.mean.find(tail(metric)); found != scores.mean.end())
        return found->second;
  return INFINITY;
}

}  // namespace restage::sweep
