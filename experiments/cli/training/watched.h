// Everything that watches a training in its run directory: logs, the summary, a profile.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "autograd/base/atomic_file.h"
#include "experiments/cli/training/train.h"
#include "experiments/observers/loggers.h"
#include "experiments/observers/summary.h"
#include "train/profile.h"
#include "train/training/train_config.h"

namespace restage::cli {

/// A profile of a training, and the file that its trace goes to.
class Profiled {
 public:
  /// Makes the file at once, so that a place that cannot be written is told before any work.
  explicit Profiled(const std::string& trace) : file_(trace), trace_(trace) {}
  TrainObserver* observer() { return &profile_; }
  void finish();

 private:
  AtomicFile file_;
  std::string trace_;
  TrainProfile profile_;
};

class Watched {
 public:
  /// `run`: the folder; `first`: whether this is the first process of a team, which keeps logs;
  /// `profile`: null if there is none.
  Watched(const std::string& run, const TrainConfig& config, const TrainArguments& arguments,
          bool first, Profiled* profile);
  std::vector<TrainObserver*> observers();
  /// Trains, and tells everybody how it ended.
  void run(const std::function<void()>& train);

 private:
  void end(RunEnd how);

  RunLogs logs_;
  RunSummary summary_;
  Profiled* profile_;
  std::vector<TrainObserver*> more_;
};

}  // namespace restage::cli
