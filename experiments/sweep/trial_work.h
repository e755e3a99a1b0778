// All that sweeps know of training configurations: which artifacts a trial needs, its id, and the
// work itself. Whatever changes about configurations, stages and the store changes here.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "datasets/schema.h"
#include "experiments/evaluation/evaluation.h"
#include "experiments/sweep/sweep_file.h"
#include "nn/config/config_tree.h"
#include "train/forecast.h"
#include "train/trainer.h"

namespace restage::sweep {

using Json = nlohmann::ordered_json;

/// What one stage leaves. `id`: first 12 hex digits of a SHA-256 (experiments.md, "Words").
struct StageArtifact {
  std::string stage, id;
  bool there = false;  ///< in the store, complete
};

struct PlannedTrial {
  std::string id, case_name;
  uint64_t seed = 0;
  std::map<std::string, std::string> overrides;  ///< what distinguishes it, values as YAML
  std::string config_yaml;                       ///< fully resolved
  std::vector<StageArtifact> artifacts;          ///< in the order of training
};

/// Makes PlannedTrials; remembers the checksums of data that it has read, and which stages it has
/// found to be trainable. Says what it is doing if that takes more than two seconds.
class TrialPlanner {
 public:
  TrialPlanner(Evaluate evaluate, std::string store);
  ~TrialPlanner();

  /// `tree`: a whole configuration, the trial's settings laid over its base. It is read strictly
  /// and checked as `restage train` would. `case_name` and `overrides` are the caller's to fill in.
  /// `name`: of the trial, such as "trial 3 of 15", where it is said what takes long.
  PlannedTrial plan(const ConfigNode& tree, const std::string& name = "the trial");
  /// The keys among `keys` (dotted) that no stage of this configuration reads.
  static std::vector<std::string> unread(const ConfigNode& tree,
                                         const std::vector<std::string>& keys);

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

/// Is it in the store, complete? Cheap.
bool artifact_there(const std::string& store, const std::string& stage, const std::string& id);

/// A set of sequences as TrialOutcome::metrics holds it.
Json set_json(const SystemScores& scores, const std::vector<std::string>& names);

struct TrialOutcome {
  std::map<std::string, std::string> artifacts;  ///< stage to id
  Json metrics = Json::object();  ///< {set: {"mean": {...}, "sequences": [{"name", ...}]}}
  /// {stage: {"steps", "batch", "curves": [{"figure", "points": [[step, value]]}]}}
  Json training = Json::object();
  /// What somebody said that the trial came to ('sweep tell').
  std::optional<double> told = {};
};

/// Trains what is missing in the store and evaluates. `id`: InputError if the trial is another one
/// by now, since its data changed. `last_stage`: makes the artifacts up to that stage and no more.
/// May be called again after an interruption and goes on where it was. Throws Interrupted after a
/// checkpoint if a signal came (the caller has a StopScope).
TrialOutcome run_trial(const std::string& config_yaml_path, const std::string& id,
                       const Evaluate& evaluate, const std::string& store,
                       const TrainOptions& options, const std::string& last_stage = "");

/// What a trial's system makes of a sequence of the benchmark, as it is evaluated; nothing while
/// the store lacks one of its artifacts.
std::optional<Prediction> perform(const std::string& config_yaml_path, const std::string& store,
                                  const std::string& sequence_folder);

/// What the stages of a configuration cost.
std::vector<StageForecast> measure(const ConfigNode& tree);

}  // namespace restage::sweep
