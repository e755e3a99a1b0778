// DIR/plan.json: what a sweep's folder stands for (docs/experiments.md). It may come from any
// machine, so nothing in it is believed.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "experiments/sweep/json_reader.h"
#include "experiments/sweep/sweep_file.h"

namespace restage::sweep {

/// A trial as its plan and its result know it.
struct TrialEntry {
  std::string id;         ///< 12 hex digits
  std::string case_name;  ///< empty: no cases
  uint64_t seed = 0;
  std::map<std::string, nlohmann::json> overrides = {};             ///< by key
  std::vector<std::pair<std::string, std::string>> artifacts = {};  ///< stage and id, as made
};

/// What the folder must know of a search.
struct SearchRule {
  std::string kind, metric;
  int trials = 0;  ///< that `sweep run` asks for, if the kind asks; not more than there are points
  bool asks() const { return kind == "tpe"; }
};

struct PlanFile {
  std::string directory;  ///< from which the sweep was planned, seen from DIR
  std::string store;      ///< of artifacts, seen from there; "": not said
  Evaluate evaluate;
  int retries = 0;
  std::optional<EarlyStop> early_stop;
  std::optional<SearchRule> search = {};
  std::vector<TrialEntry> trials;
};

/// Nothing if DIR has none. InputError: damaged.
std::optional<PlanFile> read_plan_file(const std::string& dir);
std::string plan_file_text(const PlanFile& plan);

/// 12 lower-case hex digits.
bool is_trial_id(const std::string& text);
/// Id, case, seed, overrides and artifacts of an entry of plan.json, or of a result.json.
template <class Json>
TrialEntry read_entry(const JsonReader<Json>& reader, const Json& entry);
nlohmann::ordered_json entry_json(const TrialEntry& trial);
/// null without a rule.
nlohmann::ordered_json early_stop_json(const std::optional<EarlyStop>& rule);

}  // namespace restage::sweep
