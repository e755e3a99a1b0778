// The training loop: stages in order, metrics, validation, checkpoints, resume, stop on a signal.
#pragma once

#include "autograd/kernels/matmul_precision.h"
#include "train/config_reader.h"
#include "train/progress.h"
#include "train/run.h"
#include "train/stage.h"

namespace restage {

struct LoopConfig {
  int64_t log_every = 50, validate_every = 1000, checkpoint_every = 1000;
};

template <class V>
void visit(V& v, LoopConfig& c) {
  v("log_every", c.log_every, "steps between lines of metrics.jsonl", positive());
  v("validate_every", c.validate_every, "steps between validations", positive());
  v("checkpoint_every", c.checkpoint_every, "steps between checkpoints", positive());
}

/// Runs the stages to their ends, going on from the run's checkpoint if it was resumed. `make`
/// builds a stage when its turn comes. `precision` is that of the steps' products; validation has
/// float32's, like everything that uses the models later. Throws Interrupted after writing a
/// checkpoint when a signal came. Returns the trained models.
ModelSet train(RunDir& run, const std::vector<std::string>& stages, const LoopConfig& loop,
               const std::function<std::unique_ptr<Stage>(const std::string&)>& make, bool quiet,
               MatmulPrecision precision = MatmulPrecision::float32);

}  // namespace restage
