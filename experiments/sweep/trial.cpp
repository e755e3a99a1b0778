#include "experiments/sweep/trial.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <new>

#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"

namespace restage::sweep {
namespace {

namespace fs = std::filesystem;
constexpr double kBeat = 1, kPatience = 20;  // seconds

/// The pool makes log.txt the standard error of its trials; others get a copy of the log there.
bool is_standard_error(const std::string& path) {
  struct stat log {
  }, error{};
  return ::stat(path.c_str(), &log) == 0 && ::fstat(STDERR_FILENO, &error) == 0 &&
         log.st_dev == error.st_dev && log.st_ino == error.st_ino;
}

/// Relative paths in configurations begin where the sweep was planned, wherever an engine starts
/// us.
SweepDir enter(const std::string& path) {
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

std::string busy(const std::string& id, const std::optional<LeaseHolder>& holder) {
  return "trial " + id + " is being run by " +
         (holder ? holder->text() : std::string("somebody who has just ended")) +
         "; wait for it, or stop it first";
}

}  // namespace

void perform_stage(const std::string& path, const std::string& id, const std::string& stage,
                   bool quiet) {
  const SweepDir dir = enter(path);
  const auto& artifacts = dir.trial(id).artifacts;
  const bool known = std::any_of(artifacts.begin(), artifacts.end(),
                                 [&](const auto& entry) { return entry.first == stage; });
  if (!known)
    throw InputError("", "trial " + id + " trains no stage '" + stage + "'",
                     "name one of its artifacts in plan.json");
  const StopScope stop;
  run_trial(dir.folder(id) + "/config.yaml", id, dir.evaluate, dir.store, quiet, stage);
}

bool perform_trial(const std::string& path, const std::string& id, bool quiet) {
  const SweepDir dir = enter(path);
  const TrialEntry& trial = dir.trial(id);
  const auto is_done = [&] {
    const auto result = read_result(dir, id);
    return result && result->state == "done";
  };
  if (is_done()) return false;

  const StopScope stop;
  const std::string token = stop_token(dir.path);
  std::atomic<bool> asked = false;
  LeaseOptions options{kBeat, kPatience, [&] {
                         if (stop_token(dir.path) != token && !asked.exchange(true))
                           ::kill(::getpid(), SIGTERM);
                       }};
  std::optional<Lease> lease = Lease::take(dir.lease(id), "trial " + id, options);
  if (!lease) throw WorkError(busy(id, Lease::holder(dir.lease(id))));
  if (is_done()) {
    lease->forget();
    return false;
  }
  std::error_code ignored;
  fs::remove(dir.result(id), ignored);  // of an attempt that failed or was stopped
  if (!is_standard_error(dir.log(id))) set_log_file(dir.log(id));

  const auto start = std::chrono::steady_clock::now();
  TrialOutcome outcome;
  const auto finish = [&](const std::string& state, const std::string& error) {
    if (lease->lost()) throw WorkError(busy(id, Lease::holder(dir.lease(id))));
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    write_result(dir, trial, state, error, outcome, took.count());
  };
  try {
    log_info("trial " + id + ", seed " + std::to_string(trial.seed));
    outcome = run_trial(dir.folder(id) + "/config.yaml", id, dir.evaluate, dir.store, quiet);
    finish("done", "");
    lease->forget();
    return true;
  } catch (const Interrupted&) {
    finish("stopped", "");
    throw;
  } catch (const Error& error) {
    finish("failed", error.what());
    throw;
  } catch (const std::bad_alloc&) {
    const WorkError error("not enough memory; give the trial more, or make it smaller");
    finish("failed", error.what());
    throw error;
  } catch (const std::exception& error) {
    finish("failed", error.what());
    throw WorkError(error.what());
  }
}

}  // namespace restage::sweep
