#include "experiments/sweep/plan.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <set>

#include "autograd/base/nearest.h"
#include "autograd/base/words.h"
#include "experiments/sweep/objective.h"
#include "nn/config/config.h"
#include "train/training/train_config.h"

namespace restage::sweep {
namespace {

constexpr size_t kMostTrials = 100'000;

/// Lays `key: value` over a configuration, keeping the places of both.
void lay(ConfigNode& root, const Setting& setting) {
  ConfigNode value = setting.value;
  std::string rest = setting.key;
  while (true) {
    const size_t dot = rest.rfind('.');
    value.key = rest.substr(dot == std::string::npos ? 0 : dot + 1);
    ConfigNode map;
    map.kind = ConfigNode::Kind::map;
    map.place = map.key_place = setting.value.key_place;
    map.children = {std::move(value)};
    value = std::move(map);
    if (dot == std::string::npos) break;
    rest.resize(dot);
  }
  merge_config(root, std::move(value));
}

/// One case with one point of every axis.
struct Combination {
  const Case* one = nullptr;
  Settings settings;  ///< of the case and the axes
};

/// Grid, zip, and the points of a search.
std::vector<Axis> axes_of(const SweepFile& file) {
  std::vector<Axis> out = file.axes;
  if (!file.search) return out;
  Axis axis;
  for (const search::Dimension& one : file.search->space) axis.keys.push_back(one.key);
  for (const search::Point& point : file.search->points())
    axis.points.push_back(settings_at(file.search->space, point));
  out.push_back(std::move(axis));
  return out;
}

std::vector<Combination> combinations(const SweepFile& file) {
  size_t count = file.cases.size() * std::max<size_t>(1, file.seeds.size());
  const std::vector<Axis> axes = axes_of(file);
  for (const Axis& axis : axes)
    if ((count *= axis.points.size()) > kMostTrials)
      throw InputError(file.path, "gives more than " + std::to_string(kMostTrials) + " trials",
                       "vary fewer keys at once");
  std::vector<Combination> out;
  for (const Case& one : file.cases) out.push_back({&one, one.settings});
  for (const Axis& axis : axes) {
    std::vector<Combination> wider;
    for (const Combination& before : out)
      for (const Settings& point : axis.points) {
        wider.push_back(before);
        wider.back().settings.insert(wider.back().settings.end(), point.begin(), point.end());
      }
    out = std::move(wider);
  }
  return out;
}

const ConfigNode* value_of(const std::string& key, const Combination& combination,
                           const Settings& set) {
  for (const Settings* settings : {&combination.settings, &set})
    for (const Setting& setting : *settings)
      if (setting.key == key) return &setting.value;
  return nullptr;
}

std::vector<std::string> keys_of(const SweepFile& file) {
  std::vector<std::string> out;
  for (const Axis& axis : file.axes) out.insert(out.end(), axis.keys.begin(), axis.keys.end());
  if (file.search)
    for (const search::Dimension& one : file.search->space) out.push_back(one.key);
  for (const Setting& setting : file.set) out.push_back(setting.key);
  for (const Case& one : file.cases)
    for (const Setting& setting : one.settings) out.push_back(setting.key);
  return out;
}

std::string how_to_mend(const Exclusion& exclusion, const std::vector<std::string>& keys) {
  for (const Setting& wanted : exclusion.values) {
    if (std::find(keys.begin(), keys.end(), wanted.key) != keys.end()) continue;
    const std::string close = nearest(wanted.key, keys);
    return close.empty() ? "nothing here varies " + in_quotes(wanted.key)
                         : "did you mean " + in_quotes(close) + "?";
  }
  return "correct its values, or remove it";
}

/// Leaves out what `exclude` names. Each of its entries must have an effect.
std::vector<Combination> without_excluded(const SweepFile& file, std::vector<Combination> all) {
  std::set<const Exclusion*> used;
  std::vector<Combination> out;
  for (Combination& combination : all) {
    bool excluded = false;
    for (const Exclusion& exclusion : file.exclude) {
      const bool hit =
          std::all_of(exclusion.values.begin(), exclusion.values.end(), [&](const Setting& wanted) {
            const ConfigNode* value = value_of(wanted.key, combination, file.set);
            return value != nullptr && same_value(*value, wanted.value);
          });
      if (!hit) continue;
      used.insert(&exclusion);
      excluded = true;
    }
    if (!excluded) out.push_back(std::move(combination));
  }
  for (const Exclusion& exclusion : file.exclude) {
    if (used.contains(&exclusion)) continue;
    throw InputError(exclusion.place.text(), "this 'exclude' matches no combination",
                     how_to_mend(exclusion, keys_of(file)));
  }
  if (out.empty()) throw InputError(file.path, "'exclude' leaves no trial", "exclude less");
  return out;
}

std::string shown(const Setting& setting) {
  return in_quotes(setting.key + ": " + value_text(setting.value));
}

[[noreturn]] void fail_same(const Combination& a, const Combination& b) {
  for (size_t i = 0; i < b.settings.size() && a.one == b.one; ++i)
    if (value_text(a.settings[i].value) != value_text(b.settings[i].value) ||
        a.settings[i].value.place.column != b.settings[i].value.place.column ||
        a.settings[i].value.place.line != b.settings[i].value.place.line)
      throw InputError(
          b.settings[i].value.place.text(),
          shown(a.settings[i]) + " and " + shown(b.settings[i]) + " give the same trial",
          "leave one out; names, folders and logging change no result");
  if (a.one == b.one && !b.settings.empty()) {
    const std::string keys = joined(b.settings, &Setting::key);
    throw InputError(b.settings.back().value.place.text(), "a value of " + keys + " is given twice",
                     "leave one out");
  }
  throw InputError(b.one->place.text(),
                   "the cases " + in_quotes(a.one->name) + " and " + in_quotes(b.one->name) +
                       " give the same trial",
                   "leave one out; names, folders and logging change no result");
}

/// The configuration of a combination: its base, what holds for all, its own settings.
ConfigNode tree_of(const SweepFile& file, const Combination& combination) {
  const std::string& own = combination.one->base;
  ConfigNode tree = load_config_tree(own.empty() ? file.base : own);
  for (const Settings* settings : {&file.set, &combination.settings})
    for (const Setting& setting : *settings) lay(tree, setting);
  return tree;
}

class Planner {
 public:
  explicit Planner(const SweepFile& file) : file_(file), planner_(file.evaluate, file.store) {
    for (const Setting& setting : file.set) unread_.insert(setting.key);
  }

  SweepPlan plan() {
    const std::vector<Combination> all = without_excluded(file_, combinations(file_));
    for (const Combination& combination : all) trials_ += seeds_of(combination);
    for (const Combination& combination : all) add(combination);
    for (const Setting& setting : file_.set)
      if (unread_.contains(setting.key)) fail_unread(setting);
    count();
    return std::move(plan_);
  }

 private:
  static bool has_seed(const Combination& combination) {
    return std::any_of(combination.settings.begin(), combination.settings.end(),
                       [](const Setting& setting) { return setting.key == "seed"; });
  }
  size_t seeds_of(const Combination& combination) const {
    return has_seed(combination) ? 1 : std::max<size_t>(1, file_.seeds.size());
  }

  void add(const Combination& combination) {
    ConfigNode tree = tree_of(file_, combination);
    std::map<std::string, std::string> overrides;
    std::vector<std::string> keys;
    for (const Setting& setting : combination.settings) {
      overrides[setting.key] = value_text(setting.value);
      keys.push_back(setting.key);
    }
    check_read(tree, combination, keys);
    for (size_t s = 0; s < seeds_of(combination); ++s) {
      if (!has_seed(combination) && !file_.seeds.empty()) {
        ConfigNode seed;
        seed.kind = ConfigNode::Kind::scalar;
        seed.text = std::to_string(file_.seeds[s]);
        seed.place = seed.key_place = {file_.path, 0, 0};
        lay(tree, {"seed", seed});
      }
      PlannedTrial trial = planner_.plan(tree, "trial " + std::to_string(plan_.trials.size() + 1) +
                                                   " of " + std::to_string(trials_));
      trial.case_name = combination.one->name;
      trial.overrides = overrides;
      const auto [found, fresh] = ids_.emplace(trial.id, combination);
      if (!fresh) fail_same(found->second, combination);
      plan_.trials.push_back(std::move(trial));
    }
  }

  /// What varies must be read wherever it is given, what holds for all trials by one at least.
  void check_read(const ConfigNode& tree, const Combination& combination,
                  const std::vector<std::string>& keys) {
    for (const std::string& key : TrialPlanner::unread(tree, keys))
      for (const Setting& setting : combination.settings)
        if (setting.key == key) fail_unread(setting);
    const std::vector<std::string> open(unread_.begin(), unread_.end());
    const auto still = TrialPlanner::unread(tree, open);
    unread_ = {still.begin(), still.end()};
  }

  [[noreturn]] static void fail_unread(const Setting& setting) {
    throw InputError(setting.value.key_place.text(),
                     "no stage reads " + in_quotes(setting.key) +
                         ": it is not among the 'stages' of this configuration",
                     "remove it, or add the stage");
  }

  void count() {
    std::map<std::string, std::pair<int, bool>> uses;  // stage and id: trials, there
    for (const PlannedTrial& trial : plan_.trials)
      for (const StageArtifact& artifact : trial.artifacts) {
        auto& entry = uses[artifact.stage + "-" + artifact.id];
        ++entry.first;
        entry.second = artifact.there;
      }
    for (const auto& [name, entry] : uses) {
      ++(entry.second ? plan_.there : plan_.to_make);
      plan_.shared += entry.first > 1;
    }
  }

  const SweepFile& file_;
  TrialPlanner planner_;
  std::set<std::string> unread_;  ///< keys of `set` that no trial has read so far
  std::map<std::string, Combination> ids_;
  size_t trials_ = 0;  ///< how many there will be
  SweepPlan plan_;
};

/// The metric must be one that some trial's training gives.
void check(const EarlyStop& rule, const SweepPlan& plan) {
  std::vector<std::string> known;
  for (const StageType& type : stage_types())
    for (std::string& figure : known_figures(type)) known.push_back(std::move(figure));
  if (std::find(known.begin(), known.end(), rule.metric) == known.end()) {
    const std::string close = nearest(rule.metric, known);
    throw InputError(
        rule.place.text(), "no stage measures " + in_quotes(rule.metric),
        close.empty() ? "use one of " + joined(known) : "did you mean " + in_quotes(close) + "?");
  }
  for (const PlannedTrial& trial : plan.trials)
    for (const StageArtifact& artifact : trial.artifacts)
      if (artifact.stage == rule.stage()) return;
  throw InputError(rule.place.text(), "no trial trains the stage " + in_quotes(rule.stage()),
                   "name a metric of a stage that is trained");
}

/// Numbers, true, false, null, text, lists.
Json node_json(const ConfigNode& node) {
  if (node.kind == ConfigNode::Kind::null) return nullptr;
  if (node.kind == ConfigNode::Kind::list || node.kind == ConfigNode::Kind::map) {
    Json out = node.kind == ConfigNode::Kind::list ? Json::array() : Json::object();
    for (const ConfigNode& child : node.children) {
      if (node.kind == ConfigNode::Kind::list)
        out.push_back(node_json(child));
      else
        out[child.key] = node_json(child);
    }
    return out;
  }
  if (node.quoted) return node.text;
  if (node.text == "true" || node.text == "false") return node.text == "true";
  const char *begin = node.text.data(), *end = begin + node.text.size();
  int64_t whole = 0;
  if (const auto r = std::from_chars(begin, end, whole); r.ec == std::errc() && r.ptr == end)
    return whole;
  double real = 0;
  const auto r = std::from_chars(begin, end, real);
  if (r.ec == std::errc() && r.ptr == end && std::isfinite(real)) return real;
  return node.text;
}

}  // namespace

std::vector<std::pair<std::string, ConfigNode>> configurations(const SweepFile& file) {
  std::vector<std::pair<std::string, ConfigNode>> out;
  for (const Combination& one : without_excluded(file, combinations(file)))
    out.emplace_back(one.one->name, tree_of(file, one));
  return out;
}

SweepPlan plan_sweep(const SweepFile& file) {
  SweepPlan plan = Planner(file).plan();
  if (file.early_stop) check(*file.early_stop, plan);
  if (file.search && !file.search->metric.empty())
    check_metric(file.search->metric, file.search->metric_place, plan, file.evaluate);
  return plan;
}

Forecast measure(const SweepPlan& plan) {
  Forecast out;
  std::set<std::string> counted;                                  // artifacts
  std::map<std::string, std::vector<StageForecast>> by_question;  // everything but the seed
  for (const PlannedTrial& trial : plan.trials) {
    const bool nothing = std::all_of(
        trial.artifacts.begin(), trial.artifacts.end(),
        [&](const StageArtifact& a) { return a.there || counted.contains(a.stage + a.id); });
    if (nothing) continue;
    const ConfigNode tree = parse_yaml(trial.config_yaml, trial.id);
    auto [stages, is_new] = by_question.try_emplace(trial.case_name + "|" + describe(trial));
    if (is_new) stages->second = measure(tree);
    TrainConfig config;
    read_config(tree, config);
    double own = 0;
    for (const StageArtifact& artifact : trial.artifacts) {
      if (artifact.there) continue;
      const bool fresh = counted.insert(artifact.stage + artifact.id).second;
      for (const StageForecast& one : stages->second) {
        if (one.stage != artifact.stage) continue;
        own += one.seconds(config.loop.validate_every);
        if (!fresh) continue;
        out.seconds += one.seconds(config.loop.validate_every);
        out.memory_bytes = std::max(out.memory_bytes, one.memory);
      }
    }
    out.longest = std::max(out.longest, own);
  }
  return out;
}

TrialEntry entry_of(const PlannedTrial& trial) {
  TrialEntry out{trial.id, trial.case_name, trial.seed};
  for (const auto& [key, value] : trial.overrides)
    out.overrides[key] = node_json(parse_yaml(value, "", true));
  for (const StageArtifact& artifact : trial.artifacts)
    out.artifacts.emplace_back(artifact.stage, artifact.id);
  return out;
}

std::string describe(const PlannedTrial& trial) {
  return joined(trial.overrides, [](const auto& one) { return one.first + "=" + one.second; });
}

}  // namespace restage::sweep
