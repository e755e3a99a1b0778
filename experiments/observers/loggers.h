// What loop.logs, --tensorboard and --csv hang on the loop of `restage train`.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "experiments/observers/event_file.h"
#include "experiments/observers/mirrored_logs.h"
#include "train/trainer.h"

namespace restage {

/// Event files under RUN/tensorboard/STAGE, which TensorBoard shows as one run for each stage:
/// scalars of every line of metrics.jsonl; at validations histograms of all weights, and what the
/// stage shows (Stage::show) as a picture.
class TensorBoardLog final : public TrainObserver {
 public:
  explicit TensorBoardLog(std::string run) : folder_(std::move(run) + "/tensorboard") {}
  void on_begin(const Stage& stage, int64_t done) override;
  void on_log(const Stage& stage, int64_t done, const NamedValues& values) override;
  void on_validation(Stage& stage, int64_t done, const NamedValues& figures) override;

 private:
  std::string folder_;
  std::optional<EventFile> file_;
};

/// RUN/metrics.csv: stage,step,name,value, what metrics.jsonl holds. Renewed at every checkpoint,
/// so it is never of another past than the run's.
class CsvLog final : public TrainObserver {
 public:
  explicit CsvLog(std::string run) : run_(std::move(run)) {}
  void on_checkpoint(const Stage& stage, int64_t done, const std::string& path) override;

 private:
  std::string run_;
};

/// All logs of a run that loop.logs names. A run that goes on has been taken back to its
/// checkpoint.
class RunLogs {
 public:
  /// `run`: the folder; `name` and `yaml`: of its configuration.
  RunLogs(const std::string& run, const std::string& name, const std::string& yaml,
          const std::vector<std::string>& logs);
  std::vector<TrainObserver*> observers() const;
  /// How the training ended, for logs that say so.
  void end(RunEnd how);

 private:
  std::vector<std::unique_ptr<TrainObserver>> all_;
  MirroredLogs* mirrored_ = nullptr;  // one of them
};

}  // namespace restage
