#include "experiments/sweep/sweep_dir.h"

#include <chrono>
#include <cmath>
#include <deque>
#include <filesystem>
#include <fstream>
#include <set>
#include <thread>

#include "autograd/base/atomic_file.h"
#include "autograd/base/host.h"
#include "autograd/base/interrupt.h"
#include "autograd/base/nearest.h"
#include "autograd/base/words.h"
#include "nn/config/config_reader.h"

namespace restage::sweep {

using tables::TrialResult;
using tables::TrialState;

namespace {

namespace fs = std::filesystem;
using Kind = ConfigNode::Kind;

ConfigNode text_node(const std::string& text) { return config_detail::write_leaf(text); }

/// Adds `key: value` to a map.
void put(ConfigNode& map, const std::string& key, ConfigNode value) {
  map.kind = Kind::map;
  value.key = key;
  map.children.push_back(std::move(value));
}

void append(ConfigNode& list, ConfigNode value) {
  list.kind = Kind::list;
  value.key.clear();
  list.children.push_back(std::move(value));
}

ConfigNode settings_node(const Settings& settings) {
  ConfigNode out;
  out.kind = Kind::map;
  for (const Setting& setting : settings) put(out, setting.key, setting.value);
  return out;
}

/// The lists of an axis, by key.
ConfigNode axis_node(const Axis& axis) {
  ConfigNode out;
  for (size_t k = 0; k < axis.keys.size(); ++k) {
    ConfigNode list;
    for (const Settings& point : axis.points) append(list, point[k].value);
    put(out, axis.keys[k], std::move(list));
  }
  return out;
}

/// The sweep file with everything that the command line added, base and store seen from `dir`.
std::string resolved(const SweepFile& file, const std::string& dir) {
  ConfigNode root, grid, zip, cases, exclude, seeds;
  put(root, "name", text_node(file.name));
  put(root, "base", text_node(fs::relative(file.base, dir).string()));
  if (!file.set.empty()) put(root, "set", settings_node(file.set));
  for (const Axis& axis : file.axes) {
    if (axis.keys.size() == 1)
      put(grid, axis.keys[0], axis_node(axis).children[0]);
    else
      append(zip, axis_node(axis));
  }
  if (!grid.children.empty()) put(root, "grid", std::move(grid));
  if (!zip.children.empty()) put(root, "zip", std::move(zip));
  for (const Case& one : file.cases) {
    if (one.name.empty()) continue;
    ConfigNode node = settings_node(one.settings);
    if (!one.base.empty()) put(node, "base", text_node(fs::relative(one.base, dir).string()));
    put(cases, one.name, std::move(node));
  }
  if (!cases.children.empty()) put(root, "cases", std::move(cases));
  if (file.search) put(root, "search", search_node(*file.search));
  for (const Exclusion& exclusion : file.exclude) append(exclude, settings_node(exclusion.values));
  if (!exclude.children.empty()) put(root, "exclude", std::move(exclude));
  for (const uint64_t seed : file.seeds) append(seeds, config_detail::write_leaf(seed));
  if (!seeds.children.empty()) put(root, "seeds", std::move(seeds));
  if (!file.evaluate.benchmark.empty()) {
    ConfigNode evaluate, sets;
    put(evaluate, "benchmark", text_node(file.evaluate.benchmark));
    for (const std::string& set : file.evaluate.sets) append(sets, text_node(set));
    put(evaluate, "sets", std::move(sets));
    put(root, "evaluate", std::move(evaluate));
  }
  put(root, "retries", config_detail::write_leaf(file.retries));
  if (file.early_stop) {
    const EarlyStop& rule = *file.early_stop;
    ConfigNode early;
    put(early, "metric", text_node(rule.metric));
    put(early, "rule", text_node(rule.rule));
    put(early, "after", config_detail::write_leaf(rule.after));
    put(root, "early_stop", std::move(early));
  }
  return "# made from " + file.path + " and " + file.base + "\n" + config_to_yaml(root);
}

std::optional<SearchRule> search_rule(const SweepFile& file) {
  if (!file.search) return std::nullopt;
  const Search& search = *file.search;
  const double points = search::size_of(search.space);  // few, or a space without an end
  const int trials = points < search.trials ? static_cast<int>(points) : search.trials;
  return SearchRule{search.kind, search.metric, trials};
}

using Files = std::vector<std::pair<std::string, std::string>>;  // path, content

/// Those that do not hold this already.
Files new_ones(const Files& files) {
  Files out;
  for (const auto& [path, content] : files) {
    std::ifstream file(path, std::ios::binary);
    if (!file || std::string(std::istreambuf_iterator<char>(file), {}) != content)
      out.emplace_back(path, content);
  }
  return out;
}

/// Drafts of `target` (name_beside), whose writers are known to be gone.
void remove_drafts_of(const fs::path& target) {
  std::error_code ignored;
  const std::string prefix = target.filename().string() + ".part";
  for (const auto& entry : fs::directory_iterator(target.parent_path(), ignored))
    if (entry.path().filename().string().starts_with(prefix)) fs::remove(entry.path(), ignored);
}

}  // namespace

const TrialEntry& SweepDir::trial(const std::string& id) const {
  std::vector<std::string> ids;
  for (const TrialEntry& entry : trials) {
    if (entry.id == id) return entry;
    ids.push_back(entry.id);
  }
  const std::string close = nearest(id, ids);
  throw InputError(path, "has no trial " + in_quotes(id),
                   close.empty() ? "'restage sweep status " + path + "' lists them"
                                 : "did you mean " + in_quotes(close) + "?");
}

int write_sweep_dir(const std::string& dir, const SweepFile& file, const SweepPlan& plan) {
  std::error_code ignored;
  if (fs::exists(dir, ignored) && !fs::exists(dir + "/sweep.yaml", ignored) &&
      !fs::exists(dir + "/trials", ignored) &&
      (!fs::is_directory(dir, ignored) || !fs::is_empty(dir, ignored)))
    throw InputError(dir, "exists and is no sweep's folder", "choose another folder for --out");
  make_folder(dir + "/trials");
  PlanFile written{fs::relative(fs::current_path(), dir).string(),
                   file.store,
                   file.evaluate,
                   file.retries,
                   file.early_stop,
                   search_rule(file),
                   {}};
  std::set<std::string> ids;
  Files files;
  for (const PlannedTrial& trial : plan.trials) {
    ids.insert(trial.id);
    const std::string folder = dir + "/trials/" + trial.id;
    make_folder(folder);
    files.emplace_back(folder + "/config.yaml", trial.config_yaml);
    written.trials.push_back(entry_of(trial));
  }
  files.emplace_back(dir + "/sweep.yaml", resolved(file, dir));
  const Files sweep_file = {files.back()};
  files.emplace_back(dir + "/plan.json", plan_file_text(written));
  if (!new_ones(files).empty()) {
    Lease lease = lease_plan(dir);
    if (written.search && written.search->asks() && new_ones(sweep_file).empty()) {
      // Others may have asked for trials of the same sweep while we planned.
      if (const auto now = read_plan_file(dir))
        for (const TrialEntry& trial : now->trials)
          if (ids.insert(trial.id).second) written.trials.push_back(trial);
      files.back().second = plan_file_text(written);
    }
    for (const auto& [path, content] : new_ones(files)) {
      remove_drafts_of(path);
      write_file_atomically(path, content);
    }
    lease.forget();
  }
  int stale = 0;
  for (const auto& entry : fs::directory_iterator(dir + "/trials", ignored))
    stale += !ids.contains(entry.path().filename().string());
  return stale;
}

Lease lease_plan(const std::string& dir) {
  const StopScope stop;
  while (true) {
    if (auto lease = Lease::take(dir + "/lease", "planning")) return std::move(*lease);
    throw_if_stopped();
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

void add_trial(const SweepDir& dir, const PlannedTrial& trial) {
  make_folder(dir.folder(trial.id));
  write_file_atomically(dir.folder(trial.id) + "/config.yaml", trial.config_yaml);
  PlanFile plan = dir;
  plan.trials.push_back(entry_of(trial));
  remove_drafts_of(dir.path + "/plan.json");
  write_file_atomically(dir.path + "/plan.json", plan_file_text(plan));
}

SweepDir read_sweep_dir(const std::string& dir) {
  std::optional<PlanFile> plan = read_plan_file(dir);
  if (!plan)
    throw InputError(dir, "is no sweep's folder (it has no plan.json)",
                     "make it with 'restage sweep plan SWEEP.yaml --out " + dir + "'");
  SweepDir out{std::move(*plan), dir};
  while (out.path.size() > 1 && out.path.back() == '/') out.path.pop_back();
  return out;
}

SweepDir enter_sweep_dir(const std::string& path) {
  SweepDir dir = read_sweep_dir(path);
  dir.path = fs::absolute(dir.path).lexically_normal().string();
  while (dir.path.size() > 1 && dir.path.back() == '/') dir.path.pop_back();
  std::error_code error;
  fs::current_path(fs::path(dir.path) / dir.directory, error);
  if (error)
    throw InputError(path,
                     "the folder that it was planned from is not there (" + dir.directory + ")",
                     "plan it again");
  return dir;
}

std::optional<tables::TrialResult> read_result(const SweepDir& dir, const std::string& id) {
  try {
    return tables::read_result(dir.result(id), id);
  } catch (const ReadError& error) {
    if (!error.absent()) throw;
    return std::nullopt;
  } catch (const Error&) {
    return std::nullopt;
  }
}

void write_result(const SweepDir& dir, const TrialEntry& trial, TrialState state,
                  const std::string& error, const TrialOutcome& outcome, double seconds,
                  bool early) {
  TrialEntry made = trial;
  made.artifacts.assign(outcome.artifacts.begin(), outcome.artifacts.end());
  Json document = entry_json(made);
  document.update({{"state", tables::kTrialStates[static_cast<int>(state)]},
                   {"error", error.empty() ? Json(nullptr) : Json(error)},
                   {"training", outcome.training},
                   {"metrics", outcome.metrics},
                   {"seconds", std::round(1e3 * seconds) / 1e3},
                   {"host", host_name()},
                   {"command", "restage trial " + dir.path + " " + trial.id}});
  if (outcome.told) document["told"] = *outcome.told;
  if (early) document["early_stop"] = early_stop_json(dir.early_stop);
  write_file_atomically(dir.result(trial.id),
                        document.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

bool is_over(const SweepDir& dir, const TrialResult& result) {
  return result.state == TrialState::done ||
         (result.state == TrialState::stopped && dir.early_stop &&
          result.early_stop == nlohmann::json(early_stop_json(dir.early_stop)));
}

void remove_drafts(const SweepDir& dir, const std::string& id) { remove_drafts_of(dir.result(id)); }

void tidy(const SweepDir& dir, const std::string& id) {
  std::error_code ignored;
  bool untidy = false;
  for (const auto& entry : fs::directory_iterator(dir.folder(id), ignored)) {
    const std::string name = entry.path().filename().string();
    untidy |= name.starts_with("lease") || name.starts_with("result.json.part");
  }
  if (!untidy || Lease::holder(dir.lease(id))) return;
  if (auto lease = Lease::take(dir.lease(id), "tidying up")) {
    remove_drafts(dir, id);
    lease->forget();
  }
}

TrialStatus status_of(const SweepDir& dir, const TrialEntry& trial) {
  TrialStatus out;
  out.holder = Lease::holder(dir.lease(trial.id));
  const std::optional<TrialResult> result = read_result(dir, trial.id);
  if (result && (result->state == TrialState::done || !out.holder)) {
    out.state = tables::kTrialStates[static_cast<int>(result->state)];
    out.seconds = result->seconds;
    out.error = result->error;
    if (result->state == TrialState::done) out.holder.reset();
  } else {
    out.state = out.holder ? "running" : "pending";
  }
  return out;
}

void request_stop(const std::string& dir) {
  write_file_atomically(dir + "/stop", unique_token() + "\n");
}

std::string stop_token(const std::string& dir) {
  return is_there(dir + "/stop") ? read_file(dir + "/stop") : "";
}

std::string last_lines(const std::string& path, int most) {
  constexpr std::streamoff kTailOfLine = 4096;
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) return "";
  const std::streamoff size = file.tellg(), tail = kTailOfLine * most;
  file.seekg(std::max<std::streamoff>(0, size - tail));
  std::deque<std::string> lines;
  for (std::string line; std::getline(file, line);)
    if (line.find_first_not_of(" \t\r") != std::string::npos) lines.push_back(line);
  while (std::ssize(lines) > most) lines.pop_front();
  return joined(lines, {}, "\n");
}

std::string last_line(const std::string& path) {
  constexpr size_t kLongest = 300;
  return last_lines(path, 1).substr(0, kLongest);
}

SweepFile read_planned_file(const SweepDir& dir) {
  SweepFile file = read_sweep_file(dir.path + "/sweep.yaml");
  file.store = dir.store;
  return file;
}

}  // namespace restage::sweep
