// Which learning rate suits a stage: its loss while the rate grows from step to step (Smith 2017,
// "Cyclical learning rates for training neural networks", section 3.3).
#pragma once

#include <string>
#include <vector>

#include "autograd/kernels/matmul_precision.h"
#include "train/stage.h"

namespace restage {

struct RateSweep {
  std::string stage;
  /// Of each step that was taken: its rate, its loss, and the mean of the losses so far in which
  /// older ones count ever less.
  std::vector<double> rates, losses, smoothed;
  /// The rate at which the smoothed loss falls most steeply, and a tenth of the rate at which it is
  /// least. 0: too few steps, or the loss falls by less than it differs from step to step.
  double steepest = 0, tenth_of_least = 0;
};

/// Takes all steps of a stage whose schedule lets the rate grow; ends before if the loss is several
/// times the least so far, or not finite. Interrupted if a stop is asked for.
RateSweep sweep_rate(Stage& stage, MatmulPrecision precision);

/// Fills what follows from `rates` and `losses`.
void judge(RateSweep* sweep);

}  // namespace restage
