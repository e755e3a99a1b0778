// Logs in the files of other programs, which say what metrics.jsonl says. They are made of it: a
// training that goes on writes them anew from the lines that are left there, and adds to them. So
// no step is in them twice, and a log that is asked for later has the steps before it, too.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "train/trainer.h"

namespace restage {

/// A line of metrics.jsonl, and when it was written: seconds since 1970.
struct LogLine {
  std::string stage;
  int64_t step = 0;
  NamedValues values;  ///< those that are finite
  double time = 0;
};

enum class RunEnd { finished, stopped, failed };

/// What a log says about a run beside its lines.
struct RunFacts {
  std::string dir;   ///< the run's folder
  std::string name;  ///< of the experiment: `name` of the configuration
  std::string id;    ///< 64 hexadecimal digits; of metrics.times, so the same when the run goes on
  double started = 0;
  /// Keys by their full names, values as JSON.
  std::vector<std::pair<std::string, std::string>> config;
};
/// Reads the provenance of a run, and its times. `yaml`: its resolved configuration.
RunFacts run_facts(const std::string& dir, const std::string& name, const std::string& yaml);

/// A log in the files of another program.
class MirroredLog {
 public:
  virtual ~MirroredLog() = default;
  /// Writes a log with these lines in the place of what there is. WorkError: the disk is full.
  virtual void begin(const std::vector<LogLine>& lines) = 0;
  virtual void add(const LogLine& line) = 0;
  virtual void end(RunEnd how, double time) = 0;
};

/// Keeps mirrored logs of a run. `RUN/metrics.times` has the run's id, then the time of each line
/// of metrics.jsonl, which does not hold it, since its bytes repeat.
class MirroredLogs final : public TrainObserver {
 public:
  MirroredLogs(const RunFacts& run, std::vector<std::unique_ptr<MirroredLog>> logs);
  void on_log(const Stage& stage, int64_t done, const NamedValues& values) override;
  void on_validation(Stage& stage, int64_t done, const NamedValues& figures) override;
  void end(RunEnd how);

 private:
  void add(const std::string& stage, int64_t done, const NamedValues& values);

  std::string times_;
  std::vector<std::unique_ptr<MirroredLog>> logs_;
};

}  // namespace restage
