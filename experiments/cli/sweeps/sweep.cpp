// restage sweep plan, run, status, stop: many trainings from one file.
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <map>
#include <set>
#include <thread>

#include "autograd/base/atomic_file.h"
#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"
#include "autograd/base/parallel.h"
#include "autograd/base/shipped.h"
#include "autograd/base/words.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/sweep/asking.h"
#include "experiments/sweep/plan.h"
#include "experiments/sweep/pool.h"
#include "experiments/sweep/sweep_dir.h"
#include "train/progress.h"

namespace restage::cli {
namespace {

using sweep::PlannedTrial;
using sweep::SweepDir;
using sweep::SweepPlan;

struct PlanOptions {
  std::vector<std::string> arguments;
  std::string out;
  bool measure = false;
};

struct RunOptions {
  std::vector<std::string> arguments;
  std::string out;
  int jobs = 1;
};

struct StopOptions {
  std::string dir;
  double wait = 60;  ///< seconds
};

/// SWEEP.yaml and key=value, in any order.
std::pair<std::string, std::vector<std::string>> split(const std::vector<std::string>& arguments) {
  std::pair<std::string, std::vector<std::string>> out;
  for (const std::string& argument : arguments) {
    if (argument.find('=') != std::string::npos)
      out.second.push_back(argument);
    else if (out.first.empty())
      out.first = argument;
    else
      throw InputError("", "there are two sweep files, '" + out.first + "' and '" + argument + "'",
                       "give one");
  }
  if (out.first.empty())
    throw InputError("", "no sweep file was given",
                     "use 'restage sweep plan SWEEP.yaml [key=value ...]'");
  out.first = here_or_shipped(out.first);
  return out;
}

// ---- plan ----

Json plan_json(const SweepPlan& plan) {
  Json trials = Json::array();
  for (const PlannedTrial& trial : plan.trials) trials.push_back(entry_json(entry_of(trial)));
  return {
      {"trials", std::move(trials)},
      {"artifacts", {{"there", plan.there}, {"to_make", plan.to_make}, {"shared", plan.shared}}}};
}

std::string plan_text(const SweepPlan& plan) {
  std::map<std::string, int> uses;
  for (const PlannedTrial& trial : plan.trials)
    for (const auto& artifact : trial.artifacts) ++uses[artifact.stage + "-" + artifact.id];
  std::vector<std::vector<std::string>> rows{{"trial", "case", "seed", "differs in", "artifacts"}};
  for (const PlannedTrial& trial : plan.trials) {
    const std::string artifacts = joined(trial.artifacts, [&](const auto& artifact) {
      const std::string name = artifact.stage + "-" + artifact.id;
      const int n = uses[name];
      return name + (artifact.there ? " (there)" : n > 1 ? cat(" (shared by ", n, ")") : "");
    });
    const std::string differs = sweep::describe(trial);
    rows.push_back({trial.id, trial.case_name.empty() ? "-" : trial.case_name,
                    std::to_string(trial.seed), differs.empty() ? "-" : differs, artifacts});
  }
  return markdown_table(rows) + "\n" + counted(plan.trials.size(), "trial") +
         "; artifacts: " + std::to_string(plan.there) + " there, " + std::to_string(plan.to_make) +
         " to make, " + std::to_string(plan.shared) + " shared by several trials\n";
}

/// Of a search that asks, the trials of the folder; without any, those that it will begin with.
/// Returns whether there are none yet.
bool fill_in_asked(const std::string& out, sweep::SweepFile& file) {
  if (!file.search || !file.search->asks()) return false;
  if (!out.empty()) file.search->asked = sweep::asked_in(out, file.search->space);
  if (!file.search->asked.empty()) return false;
  file.search->asked = file.search->first_points();
  return true;
}

int run_plan(const PlanOptions& options, const Common& common) {
  auto [path, words] = split(options.arguments);
  if (common.seed_given) words.push_back("seed=" + std::to_string(common.seed));
  sweep::SweepFile file = sweep::read_sweep_file(path, words);
  const bool none_asked = fill_in_asked(options.out, file);
  const SweepPlan plan = sweep::plan_sweep(file);
  Json document = plan_json(plan);
  std::string text = plan_text(plan);
  if (none_asked)
    text += "these are the first of " + counted(static_cast<size_t>(file.search->trials), "trial") +
            "; the others follow from results: 'sweep run' and 'sweep ask' write them one by one\n";
  if (options.measure) {
    const sweep::Forecast forecast = sweep::measure(plan);
    document["forecast"] = {{"seconds", forecast.seconds}, {"memory_bytes", forecast.memory_bytes}};
    char line[160];
    std::snprintf(line, sizeof line,
                  "about %s of training one after the other on %d thread%s, %.0f MiB of tensors\n",
                  duration_text(forecast.seconds).c_str(), threads(), threads() == 1 ? "" : "s",
                  static_cast<double>(forecast.memory_bytes) / 1048576.0);
    text += line;
  } else if (plan.to_make > 0) {
    text += "--measure forecasts time and memory from a few steps\n";
  }
  if (!options.out.empty()) {
    const int stale = sweep::write_sweep_dir(options.out, file, none_asked ? SweepPlan{} : plan);
    if (stale > 0)
      log_warning(std::to_string(stale) + " trials in " + options.out +
                  " are not of this sweep: they stay and are not counted");
  }
  print(common.json, document, text);
  return 0;
}

// ---- status ----

Json status_json(const SweepDir& dir) {
  Json counts = {{"pending", 0}, {"running", 0}, {"done", 0}, {"failed", 0}, {"stopped", 0}};
  Json trials = Json::array();
  for (const sweep::TrialEntry& trial : dir.trials) {
    const sweep::TrialStatus status = status_of(dir, trial);
    counts[status.state] = counts.value(status.state, 0) + 1;
    Json entry = entry_json(trial);
    entry.erase("artifacts");
    entry.update({{"state", status.state},
                  {"error", status.error.empty() ? Json(nullptr) : Json(status.error)},
                  {"seconds", status.seconds},
                  {"holder", status.holder ? Json(status.holder->text()) : Json(nullptr)}});
    trials.push_back(std::move(entry));
  }
  return {{"counts", std::move(counts)}, {"trials", std::move(trials)}};
}

std::string counts_text(const Json& status) {
  std::vector<std::string> out;
  for (const auto& [state, n] : status["counts"].items())
    if (n != 0) out.push_back(cat(n.get<int>(), " ", state));
  return joined(out) + "\n";
}

std::string status_text(const Json& status) {
  std::string out = counts_text(status);
  for (const Json& trial : status["trials"]) {
    out += trial["id"].get<std::string>() + "  " + trial["state"].get<std::string>();
    if (const std::string name = trial["case"]; !name.empty()) out += "  " + name;
    out += "  seed " + trial["seed"].dump();
    for (const auto& [key, value] : trial["overrides"].items())
      out += "  " + key + "=" + value.dump();
    for (const char* more : {"holder", "error"})
      if (trial[more].is_string()) out += "  " + on_one_line(trial[more]);
    out += "\n";
  }
  return out;
}

int run_status(const std::string& dir, const Common& common) {
  const Json status = status_json(sweep::read_sweep_dir(dir));
  print(common.json, status, status_text(status));
  return 0;
}

// ---- run ----

/// Trials of the folder that are not `known`, which they become; one more is asked for if there are
/// none. None: so many as the search says were asked for.
std::vector<sweep::TrialEntry> ask_for_more(const std::string& out, bool quiet,
                                            std::set<std::string>* known) {
  std::vector<sweep::TrialEntry> more;
  for (const bool asked : {false, true}) {
    SweepDir dir = sweep::read_sweep_dir(out);
    if (asked) {
      if (std::ssize(dir.trials) >= dir.search->trials) return more;
      std::vector<std::string> words = {"restage", "sweep",   "ask",
                                        out,       "--up-to", std::to_string(dir.search->trials)};
      if (quiet) words.emplace_back("--quiet");
      sweep::run_self(words, "asking for a trial");
      dir = sweep::read_sweep_dir(out);
    }
    for (sweep::TrialEntry& trial : dir.trials)
      if (known->insert(trial.id).second) more.push_back(std::move(trial));
    if (!more.empty()) return more;
  }
  return more;
}

int run_run(const RunOptions& options, const Common& common) {
  split(options.arguments);
  if (options.jobs < 1)
    throw InputError("", "--jobs " + std::to_string(options.jobs) + " is out of range",
                     "give 1 or more");
  const StopScope stop;
  std::vector<std::string> words = options.arguments;
  if (common.seed_given) words.push_back("seed=" + std::to_string(common.seed));
  sweep::plan_in_a_process(options.out, words, common.quiet);
  SweepDir dir = sweep::read_sweep_dir(options.out);
  make_folder(dir.store);  // now, and not after the first training
  if (::access(dir.store.c_str(), W_OK) != 0) throw_unwritable(dir.store, errno);
  const int each = std::max(1, threads() / options.jobs);
  sweep::PoolOptions pool{options.jobs, each, {}};
  std::set<std::string> known;
  for (const sweep::TrialEntry& trial : dir.trials) known.insert(trial.id);
  if (dir.search && dir.search->asks())
    pool.ask = [&] { return ask_for_more(options.out, common.quiet, &known); };
  const sweep::PoolOutcome outcome = sweep::run_pool(dir, pool);
  if (pool.ask) dir = sweep::read_sweep_dir(options.out);
  const Json status = status_json(dir);
  print(common.json, status, counts_text(status));
  finish_output();
  if (outcome.stop_requested && outcome.pending + outcome.stopped > 0)
    throw WorkError("stopped by 'restage sweep stop'; 'restage sweep run' goes on");
  return outcome.done + outcome.stopped_early == std::ssize(dir.trials) ? 0 : 1;
}

// ---- stop ----

int run_stop(const StopOptions& options, const Common& common) {
  const SweepDir dir = sweep::read_sweep_dir(options.dir);
  sweep::request_stop(options.dir);
  const auto running = [&] {
    std::vector<std::string> ids;
    for (const sweep::TrialEntry& trial : dir.trials)
      if (status_of(dir, trial).state == "running") ids.push_back(trial.id);
    return ids;
  };
  const auto start = std::chrono::steady_clock::now();
  std::vector<std::string> left = running();
  log_info("asked " + std::to_string(left.size()) + " running trials to stop");
  while (!left.empty() &&
         std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() <
             options.wait) {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    left = running();
  }
  const Json status = status_json(dir);
  print(common.json, status, counts_text(status));
  if (left.empty()) return 0;
  throw WorkError("trial " + left.front() + " still runs after " + duration_text(options.wait) +
                  "; it ends at its next step, or give --wait SECONDS");
}

}  // namespace

void add_sweep(Program& program) {
  CommandOptions group = program.add_group("sweep", "many trainings from one file");

  auto [p, plan] = program.add(
      group, "plan", "list the trials of a sweep file; with --out, write them ready to run",
      "restage sweep plan smoothness.yaml\n"
      "restage sweep plan sweep.yaml motion.weights.smoothness=0,0.1 motion.optimiser.steps=500\n"
      "restage sweep plan sweep.yaml 'seeds=range(1,6)' --out runs/sweep\n"
      "restage sweep plan sweep.yaml --measure\n"
      "restage sweep plan search.yaml search.trials=50 search.kind=latin\n"
      "restage sweep plan sweep.yaml 'motion.weights.smoothness=uniform(0,0.3)' search.trials=30",
      run_plan);
  p.add_option("SWEEP", plan.arguments,
               "SWEEP.yaml and key=value, key=a,b, key=range(a,b,step), key=uniform(a,b)")
      .required();
  p.add_option("--out", plan.out, "folder to write");
  p.add_flag("--measure", plan.measure, "forecast time and memory from a few steps of each stage");

  auto [r, run] = program.add(
      group, "run", "run every trial of a sweep that is not done; called again it goes on",
      "restage sweep run experiments/smoothness.yaml --out runs/smoothness\n"
      "restage sweep run sweep.yaml --out runs/sweep --jobs 4 motion.optimiser.steps=500",
      run_run);
  r.add_option("SWEEP", run.arguments, "SWEEP.yaml and key=value, as in 'sweep plan'").required();
  r.add_option("--out", run.out, "folder of the sweep").required();
  r.add_option("--jobs", run.jobs, "trials at once; they share the threads");

  auto [st, dir] = program.add(group, "status", "counts, and a line for every trial",
                               "restage sweep status runs/smoothness\n"
                               "restage sweep status runs/smoothness --json",
                               run_status);
  st.add_option("DIR", dir, "folder of the sweep").required();

  auto [s, stop] = program.add(group, "stop", "running trials write a checkpoint and end",
                               "restage sweep stop runs/smoothness\n"
                               "restage sweep stop runs/smoothness --wait 300",
                               run_stop);
  s.add_option("DIR", stop.dir, "folder of the sweep").required();
  s.add_option("--wait", stop.wait, "seconds to wait for them");
  add_sweep_ask(program, group);
  add_sweep_table(program, group);
  add_sweep_export(program, group);
}

}  // namespace restage::cli
