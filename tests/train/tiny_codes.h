// A training of H4D's first stage that takes a moment, on the bodies of boxes.
#pragma once

#include "tests/train/tiny_training.h"
#include "train/stages/codes_stage.h"

namespace restage::testing {

inline CodesStageConfig& codes(TrainConfig& c) {
  return c.section("codes").config.as<CodesStageConfig>();
}

/// Windows of six frames.
inline TrainConfig tiny_codes(int64_t steps) {
  TrainConfig c;
  c.seed = 7;
  CodesStageConfig& s = codes(c);
  resize(s.model, {"hidden=16", "features=16", "recurrent=16", "motion=10", "frames=6"});
  s.windows.points = 48;
  s.vertices = 60;
  s.basis_windows = 30;
  s.validation_windows = 4;
  s.optimiser.steps = steps;
  s.optimiser.batch = 4;
  s.optimiser.schedule.rate = 3e-3;
  return c;
}

}  // namespace restage::testing
