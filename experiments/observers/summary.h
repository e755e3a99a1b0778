// RUN/summary.json: how a training ended, in one place: steps and last figures of each stage, and
// the warnings that it gave.
#pragma once

#include <string>
#include <vector>

#include "experiments/observers/mirrored_logs.h"

namespace restage {

class RunSummary final : public TrainObserver {
 public:
  /// Warnings of a run that goes on are kept.
  explicit RunSummary(std::string run);
  void on_step(const Stage& stage, int64_t done, const NamedValues& values) override;
  void on_validation(Stage& stage, int64_t done, const NamedValues& figures) override;
  void on_warning(const std::string& stage, int64_t done, const TrainWarning& warning) override;
  /// Writes it.
  void end(RunEnd how);

 private:
  struct StageEnd {
    std::string stage;
    int64_t steps = 0;
    NamedValues values, figures;
  };
  struct Said {
    std::string stage;
    int64_t step;
    TrainWarning warning;
  };
  StageEnd& of(const std::string& stage);

  std::string run_;
  std::vector<StageEnd> stages_;
  std::vector<Said> warnings_;
};

}  // namespace restage
