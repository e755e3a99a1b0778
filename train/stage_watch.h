// Warnings of a training before hours are lost: what a stage's gradients, losses, figures and times
// say. Each kind once for a stage.
#pragma once

#include <limits>
#include <set>
#include <string>
#include <vector>

#include "train/gradient_watch.h"
#include "train/phases.h"
#include "train/stage.h"

namespace restage {

class StageWatch {
 public:
  /// Steps over which drawing is timed; steps and validations of one and the same figure.
  static constexpr int64_t kTimed = 100, kSameSteps = 100, kSameValidations = 3;
  static constexpr double kDrawShare = 0.5;  ///< of a step

  /// Looks at the gradients of `stage` as long as it lives.
  explicit StageWatch(Stage& stage);
  ~StageWatch() { stage_.show_gradients(nullptr); }
  StageWatch(const StageWatch&) = delete;
  StageWatch& operator=(const StageWatch&) = delete;

  /// What is to be said after a step: `values` as it is logged, the loss first.
  std::vector<TrainWarning> after_step(const NamedValues& values, const PhaseTimes& times);
  /// The same after a validation after `steps` steps in all.
  std::vector<TrainWarning> after_validation(const NamedValues& figures, int64_t steps);

 private:
  std::vector<TrainWarning> fresh(std::vector<TrainWarning> found);

  Stage& stage_;
  GradientWatch gradients_;
  std::set<std::string> said_;
  double draw_ = 0, work_ = 0, loss_ = std::numeric_limits<double>::quiet_NaN();
  int64_t timed_ = 0, same_loss_ = 0, same_figures_ = 0, validated_at_ = -1;
  NamedValues figures_;
};

}  // namespace restage
