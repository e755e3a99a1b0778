// The local engine: runs the trials of a sweep's folder as child processes, so many at once. It
// holds no locks and keeps nothing in memory that is not in the folder: it may be killed, run twice
// at a time, or stand beside other engines.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "experiments/sweep/sweep_dir.h"

namespace restage::sweep {

struct PoolOptions {
  int jobs = 1;     ///< trials at once
  int threads = 1;  ///< of each
  /// A search that asks: new trials of the folder, by us or by others, once nothing else waits;
  /// none: there are no more.
  std::function<std::vector<TrialEntry>()> ask = {};
};

struct PoolOutcome {
  int done = 0, failed = 0, stopped = 0, pending = 0;
  int stopped_early = 0;        ///< as the sweep's rule says: nothing is left to do
  bool stop_requested = false;  ///< by `restage sweep stop`
};

/// Runs every trial that is not done, going on after failures. A trial waits while another one
/// makes an artifact that it needs, if there is one that need not wait. Trials that others are
/// running are waited for. Throws Interrupted after a signal, when its children have ended (the
/// caller has a StopScope).
PoolOutcome run_pool(const SweepDir& dir, const PoolOptions& options);

/// Starts this program again with these arguments. `output`: standard output and error go there
/// (appended); "": the former nowhere, the latter to `errors` (a descriptor; -1: where ours goes).
/// Returns the process. WorkError.
int spawn_self(const std::vector<std::string>& arguments, const std::string& output, bool own_group,
               int errors = -1);

/// The process that started us, `pid`, is the one that judges what we do: when it ends, however it
/// ends, or has ended already, we get SIGTERM.
void end_with(int pid);

/// This program with these words in a process of its own; what it says is passed on to standard
/// error. Throws what ended it; `doing`: "planning".
void run_self(const std::vector<std::string>& words, const std::string& doing);

/// `restage sweep plan ARGUMENTS --out DIR` in a process of its own: planning reads data and builds
/// models, and takes that memory with it. Throws what ended it.
void plan_in_a_process(const std::string& dir, const std::vector<std::string>& arguments,
                       bool quiet);

}  // namespace restage::sweep
