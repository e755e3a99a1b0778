// What `restage train --tensorboard --csv` hangs on the loop.
#pragma once

#include <optional>
#include <string>

#include "experiments/observers/event_file.h"
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

}  // namespace restage
