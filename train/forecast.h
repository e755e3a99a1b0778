// What a stage will cost, from a few of its steps.
#pragma once

#include "autograd/kernels/matmul_precision.h"
#include "train/stage.h"

namespace restage {

struct StageForecast {
  std::string stage;
  int64_t parameters = 0;  ///< parameters of the networks that the stage hands on
  int64_t steps = 0;
  double per_step = 0, before = 0,
         validation = 0;  ///< seconds: of a step, of what the first step waits for, of a validation
  int64_t memory = 0;     ///< most that tensors took on the stage's device, bytes

  /// Seconds of the whole stage if it is validated every `validate_every` steps.
  double seconds(int64_t validate_every) const;
};

/// Takes some steps of the stage, which changes it: three seconds of them, or one that takes
/// longer. `validate`: measures one validation, too.
StageForecast forecast(Stage& stage, MatmulPrecision precision, bool validate);

int64_t count_parameters(const Stage& stage);

}  // namespace restage
