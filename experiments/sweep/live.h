// A sweep as it stands now, read from its folder and its store alone: it may run elsewhere.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "experiments/sweep/objective.h"
#include "experiments/sweep/sweep_dir.h"

namespace restage::sweep {

/// A trial that somebody works on.
struct RunningTrial {
  TrialEntry trial;
  std::string stage;            ///< in the making; "": being measured, or about to begin
  int64_t step = 0, steps = 0;  ///< of the stage
  int64_t done = 0, all = 0;    ///< steps of all stages that the trial trains
  double seconds = 0;           ///< since it was taken up
  std::optional<double> left;   ///< seconds of training that are left, about
  std::optional<double> now;    ///< the figure at the last validation
  Curve curve;                  ///< of the figure so far
  std::string holder;           ///< "process 12 on host a"
};

struct BestTrial {
  TrialEntry trial;
  double value = 0;
};

struct LiveSweep {
  std::string metric;                 ///< the figure; "": there is none
  std::map<std::string, int> counts;  ///< by state: done, failed, stopped, running, pending
  int to_come = 0;                    ///< trials that a search will still ask for
  std::vector<RunningTrial> running;
  std::optional<BestTrial> best;  ///< of those that are over
  std::optional<double> left;     ///< seconds of the whole sweep, by the time of trials so far
  /// Nothing runs and nothing is left to run.
  bool over() const;
};

/// What trials that are done came to, by id, so that their results are read once and not at every
/// look. One that is written again is read again.
struct DoneTrial {
  std::filesystem::file_time_type written;
  double seconds = 0;
  std::optional<double> value;
};
using DoneTrials = std::map<std::string, DoneTrial>;

/// `metric`: as objective.h says; "": the sweep's own. `known`: of earlier looks for this metric.
LiveSweep look_at(const SweepDir& dir, const std::string& metric, DoneTrials* known = nullptr);

/// What was seen before, to know how fast trials are.
class Pace {
 public:
  /// Fills in RunningTrial::left from the steps that were made between looks; `now` in seconds,
  /// monotonic. At the first look it rests on the time since the trial was taken up.
  void fill_in(LiveSweep& live, double now);

 private:
  struct Seen {
    double time = 0;
    int64_t done = 0;
  };
  std::map<std::string, std::vector<Seen>> seen_;  ///< by trial
};

/// The sweep in lines for a terminal of so many columns and rows: counts, the best trial, a line
/// for each running one with a bar and a curve of blocks. `rows` 0: no limit.
std::vector<std::string> picture(const LiveSweep& live, const std::string& name, int columns,
                                 int rows);
/// Values as a row of blocks, the lowest at the bottom; at most `width` of them, evenly chosen.
std::string blocks(const std::vector<double>& values, size_t width);

}  // namespace restage::sweep
