#include "experiments/sweep/plan_file.h"

#include <filesystem>
#include <limits>
#include <set>

namespace restage::sweep {
namespace {

using Json = nlohmann::ordered_json;  // the order of a trial's artifacts is that of their making
using PlanReader = JsonReader<Json>;

constexpr int kMaxDepth = 8;  ///< of an override's value

/// Counted level by level: a hostile file must not exhaust the stack.
template <class Json>
int depth(const Json& value) {
  if (!value.is_structured()) return 0;
  std::vector<const Json*> level{&value};
  int levels = 0;
  while (!level.empty() && levels <= kMaxDepth) {
    std::vector<const Json*> next;
    for (const Json* item : level)
      for (const Json& child : *item)
        if (child.is_structured()) next.push_back(&child);
    level = std::move(next);
    ++levels;
  }
  return levels;
}

Evaluate read_evaluate(const PlanReader& reader, const Json& document) {
  Evaluate out;
  if (reader.at(document, "evaluate").is_null()) return out;
  const Json& evaluate = reader.section(document, "evaluate");
  out.benchmark = reader.optional_text(evaluate, "benchmark");
  for (const Json& set : reader.list(evaluate, "sets")) {
    reader.need(set.is_string(), "sets", "a list of names");
    out.sets.push_back(set.get<std::string>());
  }
  return out;
}

std::optional<EarlyStop> read_early_stop(const PlanReader& reader, const Json& document) {
  if (reader.at(document, "early_stop").is_null()) return std::nullopt;
  const Json& rule = reader.section(document, "early_stop");
  return EarlyStop{
      reader.text(rule, "metric"), reader.text(rule, "rule"), reader.number(rule, "after"), {}};
}

std::optional<SearchRule> read_search(const PlanReader& reader, const Json& document) {
  if (reader.at(document, "search").is_null()) return std::nullopt;
  const Json& search = reader.section(document, "search");
  const uint64_t trials = reader.count(search, "trials");
  reader.need(trials <= std::numeric_limits<int>::max(), "trials", "so large elsewhere");
  return SearchRule{reader.text(search, "kind"), reader.optional_text(search, "metric"),
                    static_cast<int>(trials)};
}

Json search_json(const std::optional<SearchRule>& search) {
  if (!search) return nullptr;
  return {{"kind", search->kind}, {"metric", search->metric}, {"trials", search->trials}};
}

}  // namespace

bool is_trial_id(const std::string& text) {
  return text.size() == 12 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

template <class Json>
TrialEntry read_entry(const JsonReader<Json>& reader, const Json& entry) {
  if (!entry.is_object()) reader.fail("holds a trial that is no section");
  TrialEntry out{reader.text(entry, "id"), reader.optional_text(entry, "case")};
  reader.need(is_trial_id(out.id), "id", "12 hex digits");
  out.seed = reader.count(entry, "seed");
  for (const auto& [key, value] : reader.section(entry, "overrides").items()) {
    reader.need(depth(value) <= kMaxDepth, "overrides", "so deep elsewhere");
    out.overrides[key] = value;
  }
  for (const auto& [stage, id] : reader.section(entry, "artifacts").items()) {
    reader.need(id.is_string(), "artifacts", "a section of ids");
    out.artifacts.emplace_back(stage, id.template get<std::string>());
  }
  return out;
}
template TrialEntry read_entry(const JsonReader<nlohmann::json>&, const nlohmann::json&);

Json entry_json(const TrialEntry& trial) {
  Json out = {{"id", trial.id},
              {"case", trial.case_name},
              {"seed", trial.seed},
              {"overrides", trial.overrides},
              {"artifacts", Json::object()}};
  for (const auto& [stage, id] : trial.artifacts) out["artifacts"][stage] = id;
  return out;
}

Json early_stop_json(const std::optional<EarlyStop>& rule) {
  if (!rule) return nullptr;
  return {{"metric", rule->metric}, {"rule", rule->rule}, {"after", rule->after}};
}

std::optional<PlanFile> read_plan_file(const std::string& dir) {
  const std::string path = dir + "/plan.json";
  if (!is_there(path)) return std::nullopt;
  const PlanReader reader(path,
                          "write it again with 'restage sweep plan SWEEP.yaml --out " + dir + "'");
  const Json document = reader.parse();
  PlanFile out;
  out.directory = reader.optional_text(document, "directory");
  out.store = reader.optional_text(document, "store");
  out.evaluate = read_evaluate(reader, document);
  out.early_stop = read_early_stop(reader, document);
  out.search = read_search(reader, document);
  if (!reader.at(document, "retries").is_null()) {
    const uint64_t retries = reader.count(document, "retries");
    reader.need(retries <= std::numeric_limits<int>::max(), "retries", "so large elsewhere");
    out.retries = static_cast<int>(retries);
  }
  std::set<std::string> ids;
  for (const Json& entry : reader.list(document, "trials")) {
    out.trials.push_back(read_entry(reader, entry));
    const std::string& id = out.trials.back().id;
    if (!ids.insert(id).second) reader.fail("has the trial " + id + " twice");
  }
  return out;
}

std::string plan_file_text(const PlanFile& plan) {
  Json trials = Json::array();
  for (const TrialEntry& trial : plan.trials) trials.push_back(entry_json(trial));
  const Json document = {
      {"directory", plan.directory},
      {"store", plan.store},
      {"evaluate", {{"benchmark", plan.evaluate.benchmark}, {"sets", plan.evaluate.sets}}},
      {"retries", plan.retries},
      {"early_stop", early_stop_json(plan.early_stop)},
      {"search", search_json(plan.search)},
      {"trials", std::move(trials)}};
  return document.dump(1) + "\n";
}

}  // namespace restage::sweep
