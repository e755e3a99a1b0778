// Where the time of a training goes: by phases of a step, and by ops and modules, forwards and
// backwards; and what memory tensors take. A table for each stage, and a trace in Chrome's trace
// event format, which Perfetto and chrome://tracing show.
#pragma once

#include <array>
#include <map>
#include <mutex>
#include <string>
#include <tuple>
#include <vector>

#include "autograd/base/op_watch.h"
#include "train/trainer.h"

namespace restage {

class TrainProfile final : public TrainObserver, public OpWatcher {
 public:
  /// Events of a stage that the trace has; the table counts all.
  static constexpr size_t kMostEvents = 100'000;
  static constexpr size_t kRows = 20;  ///< of a table

  /// Watches ops until finish(). On a GPU each op is waited for, so that its time is its own.
  TrainProfile();
  ~TrainProfile() override { watch_ops(nullptr); }

  void on_begin(const Stage& stage, int64_t done) override;
  void on_step(const Stage& stage, int64_t done, const NamedValues& values) override;
  void begin(const char* name, const std::string& path, Kind kind) override;
  void end() override;

  /// Ends the watching; the table of the last stage goes to the log, as those before it have.
  void finish();
  /// The trace as JSON: {"traceEvents": [...], "otherData": {...}}. Times in microseconds.
  std::string trace() const;

 private:
  struct Row {
    int64_t calls = 0;
    double seconds = 0;  ///< without the ops within it
  };
  struct Event {
    std::string name, module;
    Kind kind;
    int thread;
    double start, seconds;
    int64_t memory;  ///< of tensors at its end, bytes
  };
  using Key = std::tuple<std::string, std::string, Kind>;  ///< op, module, pass
  struct StageTable {
    std::string stage;
    int64_t steps = 0, left_out = 0;
    int64_t peak = 0, at_backward = 0;  ///< bytes of tensors
    std::string peak_in;
    std::map<std::string, double> phases;
    std::map<Key, Row> rows;
  };
  void end_stage();
  static std::vector<std::pair<Key, Row>> sorted(const StageTable& table);
  static std::vector<std::string> lines(const StageTable& table);

  std::mutex several_threads_;
  Device device_ = {};
  double start_;
  std::vector<StageTable> tables_;
  std::vector<Event> events_;
  size_t stage_events_ = 0;
};

}  // namespace restage
