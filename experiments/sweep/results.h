// What the trials of a sweep left behind (docs/experiments.md):
// DIR/plan.json, what was planned, and DIR/trials/ID/result.json, what came of each. Results may
// come from any machine and engine, so nothing in them is believed: what is damaged, or belongs to
// another trial or plan, is told in one line and not used.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "experiments/sweep/plan_file.h"

namespace restage::tables {

/// Values by METRIC (nn/metrics/metrics.h, recorded()); what is null is not there.
using MetricValues = std::map<std::string, double>;

struct Scores {
  MetricValues mean;
  std::vector<std::pair<std::string, MetricValues>> sequences;  ///< by name, names are unique
};

struct SetResult : Scores {
  std::map<std::string, int64_t> frames = {};  ///< by sequence
  std::map<std::string, double> joints = {};   ///< PA-MPJPE by joint, metres
  /// What needs no learning, on the same sequences: "source_unchanged" and others.
  std::vector<std::pair<std::string, Scores>> references = {};
};

/// A validation's figure by step, in the order of steps.
using Curve = std::vector<std::pair<double, double>>;

/// How a trial trained one of its stages, or found it trained.
struct StageCurves {
  std::optional<int64_t> steps = {}, batch = {};
  std::vector<std::pair<std::string, Curve>> curves =
      {};  ///< by figure; the stage's first one first
};

/// Damaged: what is there cannot be used.
enum class TrialState { done, failed, stopped, pending, damaged };
inline constexpr const char* kTrialStates[] = {"done", "failed", "stopped", "pending", "damaged"};

struct TrialResult : sweep::TrialEntry {
  TrialState state = TrialState::pending;
  bool described = true;   ///< false: neither plan nor result says more than the id
  std::string error = {};  ///< of a failed one
  double seconds = 0;
  std::string host = {}, command = {};  ///< where and how it was made
  std::optional<double> told = {};      ///< what 'sweep tell' said that it came to
  nlohmann::json early_stop = nullptr;  ///< the rule that stopped it
  std::vector<std::pair<std::string, SetResult>> sets = {};  ///< of one that is done
  std::map<std::string, StageCurves> training = {};          ///< by stage; older results have none
};

struct Results {
  std::vector<TrialResult>
      trials;  ///< in the plan's order; without a plan by case, overrides, seed
  std::vector<std::string> notices;  ///< a line for each thing that is not used, and why
  int count(TrialState state) const;
};

/// One result file. InputError: damaged, or the result of another trial.
TrialResult read_result(const std::string& path, const std::string& id);
/// The same of a document that was read from `path` already.
TrialResult parse_result(const nlohmann::json& document, const std::string& path,
                         const std::string& id);
/// The sets of a section "metrics" of the document `path`, as results hold them. InputError with
/// the words `mend`: damaged.
std::vector<std::pair<std::string, SetResult>> parse_sets(const nlohmann::json& metrics,
                                                          const std::string& path,
                                                          const std::string& mend);
/// All trials of a sweep. InputError: `dir` holds no sweep. ReadError: a file of it cannot be read,
/// which says nothing about its trial.
Results read_results(const std::string& dir);

/// A value of an override as a person writes it: text without quotes.
std::string plain_text(const nlohmann::json& value);

}  // namespace restage::tables
