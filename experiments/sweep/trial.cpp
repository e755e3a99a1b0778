#include "experiments/sweep/trial.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <new>

#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"
#include "experiments/sweep/early_stop.h"

namespace restage::sweep {

using tables::TrialState;
namespace {

namespace fs = std::filesystem;
constexpr double kBeat = 1, kLeasePatience = 20;  // seconds

/// The pool makes log.txt the standard error of its trials; others get a copy of the log there.
bool is_standard_error(const std::string& path) {
  struct stat log {
  }, error{};
  return ::stat(path.c_str(), &log) == 0 && ::fstat(STDERR_FILENO, &error) == 0 &&
         log.st_dev == error.st_dev && log.st_ino == error.st_ino;
}

std::string busy(const std::string& id, const std::optional<LeaseHolder>& holder) {
  return "trial " + id + " is being run by " +
         (holder ? holder->text() : std::string("somebody who has just ended")) +
         "; wait for it, or stop it first";
}

/// Watches the stage that the sweep's rule is about; null without a rule, or if the trial has no
/// such stage.
std::unique_ptr<TrainObserver> early_stopper(const SweepDir& dir, const TrialEntry& trial) {
  if (!dir.early_stop) return nullptr;
  const std::string stage = dir.early_stop->stage();
  std::optional<StageId> own;
  std::map<std::string, StageId> all;
  for (const TrialEntry& entry : dir.trials)
    for (const auto& [name, id] : entry.artifacts) {
      if (name != stage) continue;
      all.emplace(id, StageId{stage, id, ""});
      if (entry.id == trial.id) own = StageId{stage, id, ""};
    }
  if (!own) return nullptr;
  std::vector<StageId> ids;
  for (const auto& [id, artifact] : all) ids.push_back(artifact);
  return std::make_unique<EarlyStopper>(*dir.early_stop, Store(dir.store), *own, std::move(ids));
}

}  // namespace

void perform_stage(const std::string& path, const std::string& id, const std::string& stage,
                   bool quiet) {
  const SweepDir dir = enter_sweep_dir(path);
  const auto& artifacts = dir.trial(id).artifacts;
  const bool known = std::any_of(artifacts.begin(), artifacts.end(),
                                 [&](const auto& entry) { return entry.first == stage; });
  if (!known)
    throw InputError("", "trial " + id + " trains no stage '" + stage + "'",
                     "name one of its artifacts in plan.json");
  const StopScope stop;
  TrainOptions options;
  options.quiet = quiet;
  run_trial(dir.folder(id) + "/config.yaml", id, dir.evaluate, dir.store, options, stage);
}

TrialEnd perform_trial(const std::string& path, const std::string& id, bool quiet) {
  const SweepDir dir = enter_sweep_dir(path);
  const TrialEntry& trial = dir.trial(id);
  const auto over = [&] {
    const auto result = read_result(dir, id);
    return result && is_over(dir, *result);
  };
  if (over()) {
    tidy(dir, id);
    return TrialEnd::before;
  }

  const StopScope stop;
  const std::string token = stop_token(dir.path);
  LeaseOptions options{kBeat, kLeasePatience, [&] {
                         if (stop_token(dir.path) != token) ask_to_stop();
                       }};
  std::optional<Lease> lease = Lease::take(dir.lease(id), "trial " + id, options);
  if (!lease) throw WorkError(busy(id, Lease::holder(dir.lease(id))));
  if (over()) {
    lease->forget();
    return TrialEnd::before;
  }
  // Of attempts that failed or were stopped; a killed one left nothing.
  const auto earlier = read_result(dir, id);
  const double before = earlier ? earlier->seconds : 0;
  std::error_code ignored;
  fs::remove(dir.result(id), ignored);
  remove_drafts(dir, id);
  if (!is_standard_error(dir.log(id))) set_log_file(dir.log(id));

  const auto start = std::chrono::steady_clock::now();
  TrialOutcome outcome;
  const auto finish = [&](TrialState state, const std::string& error, bool early = false) {
    if (lease->lost()) throw WorkError(busy(id, Lease::holder(dir.lease(id))));
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    write_result(dir, trial, state, error, outcome, before + took.count(), early);
  };
  const auto watcher = early_stopper(dir, trial);
  TrainOptions training;
  training.quiet = quiet;
  if (watcher) training.observers.push_back(watcher.get());
  try {
    outcome = run_trial(dir.folder(id) + "/config.yaml", id, dir.evaluate, dir.store, training);
    finish(TrialState::done, "");
    lease->forget();
    return TrialEnd::done;
  } catch (const StoppedEarly& why) {
    log_info(why.what());
    finish(TrialState::stopped, why.what(), true);
    lease->forget();
    return TrialEnd::stopped_early;
  } catch (const Interrupted&) {
    finish(TrialState::stopped, "");
    throw;
  } catch (const Error& error) {
    finish(TrialState::failed, error.what());
    throw;
  } catch (const std::bad_alloc&) {
    const WorkError error("not enough memory; give the trial more, or make it smaller");
    finish(TrialState::failed, error.what());
    throw error;
  } catch (const std::exception& error) {
    finish(TrialState::failed, error.what());
    throw WorkError(error.what());
  }
}

}  // namespace restage::sweep
