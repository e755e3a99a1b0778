// What every stage says about its optimisation.
#pragma once

#include "train/optim/adam.h"
#include "train/schedule.h"

namespace restage {

struct OptimiserConfig {
  int64_t steps = 1000, batch = 16;
  ScheduleConfig schedule;
  AdamConfig adam;
  double clip = 0;
};

template <class V>
void visit(V& v, OptimiserConfig& c) {
  v("steps", c.steps, "optimiser steps; 0: the networks stay as they begin", at_least(0));
  v("batch", c.batch, "examples per step", positive());
  v("schedule", c.schedule, "learning rate");
  v("adam", c.adam, "optimiser");
  v("clip", c.clip, "largest global norm of the gradient; 0: no clipping", at_least(0));
}

}  // namespace restage
