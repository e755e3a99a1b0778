// The training loop: stages in order, metrics, validation, checkpoints, resume, stop on a signal.
#pragma once

#include "autograd/kernels/matmul_precision.h"
#include "nn/config/config_reader.h"
#include "train/gradient_watch.h"
#include "train/progress.h"
#include "train/run.h"
#include "train/selection.h"

namespace restage {

struct LoopConfig {
  int64_t log_every = 50, validate_every = 1000, checkpoint_every = 1000;
  int64_t keep = 2, keep_every = 0, overfit_batches = 0, micro_batches = 1;
  SelectionConfig selection = {};
  bool gradient_noise = false;
  std::vector<std::string> logs = {"jsonl"};  ///< experiments/observers writes all but jsonl
};

template <class V>
void visit(V& v, LoopConfig& c) {
  v("log_every", c.log_every, "steps between lines of metrics.jsonl", positive());
  v("validate_every", c.validate_every, "steps between validations", positive());
  v("checkpoint_every", c.checkpoint_every, "steps between checkpoints", positive());
  v("keep", c.keep, "checkpoints of a stage that stay", between(1, 1000000));
  v("keep_every", c.keep_every, "those of every so many steps stay as well; 0: none", at_least(0));
  v("overfit_batches", c.overfit_batches,
    "the same so many batches again and again, to see whether they can be learned; 0: no",
    at_least(0));
  v("micro_batches", c.micro_batches,
    "parts of a step that are computed by themselves and added in order; processes share them",
    positive());
  visit(v, c.selection);
  v("gradient_noise", c.gradient_noise,
    "measure the gradient noise scale, from a step's micro-batches");
  v("logs", c.logs,
    "what a training writes beside metrics.jsonl, which is always there; not in sweeps",
    one_of({"jsonl", "csv", "tensorboard", "wandb", "mlflow"}));
}

/// Watches a training. The loop calls its observers on the thread that trains, after it has written
/// its own lines.
class TrainObserver {
 public:
  virtual ~TrainObserver() = default;
  /// A stage begins; `done` of its steps have been done before (in a run that was resumed).
  virtual void on_begin(const Stage&, int64_t /*done*/) {}
  virtual void on_step(const Stage&, int64_t /*done*/, const NamedValues&) {}
  /// A line of metrics.jsonl about training steps was written.
  virtual void on_log(const Stage&, int64_t /*done*/, const NamedValues&) {}
  /// A validation measured these figures; the observer may add some, before anything is decided by
  /// them. False: the stage ends here, as it does where loop.patience is at its end.
  virtual bool measure(Stage&, int64_t /*done*/, NamedValues* /*figures*/) { return true; }
  /// A validation was made. The stage still holds the weights that were validated (averaged weights
  /// with loop.ema).
  virtual void on_validation(Stage&, int64_t /*done*/, const NamedValues&) {}
  /// Something that a user should know; it is in the log already.
  virtual void on_warning(const std::string& /*stage*/, int64_t /*done*/, const TrainWarning&) {}
  /// A checkpoint is on the disk.
  virtual void on_checkpoint(const Stage&, int64_t /*done*/, const std::string& /*path*/) {}
};

struct TrainOptions {
  /// Precision of the matrix products of steps. Validation multiplies in float32, like everything
  /// that uses the models later.
  MatmulPrecision precision = MatmulPrecision::float32;
  bool quiet = false;
  std::vector<TrainObserver*> observers = {};
  Team* team = &alone();  ///< the processes that share the steps; all end after the same step
  /// Networks of stages that were trained elsewhere, for the file of a failed step.
  Bundle given = {};
};

/// Builds a stage when its turn comes, from what the stages before it left (`so_far`). Null: there
/// is nothing to train, and the networks of the stage have been put into `so_far`.
using MakeStage = std::function<std::unique_ptr<Stage>(const std::string& name, Bundle* so_far)>;

/// Runs the stages to their ends, going on from the run's checkpoint if it was resumed. Throws
/// Interrupted after writing a checkpoint when a signal came, whether in a step, in a validation
/// (which the resumed training makes anew) or between two stages. Returns the networks of all
/// stages.
Bundle train(RunDir& run, const std::vector<std::string>& stages, const LoopConfig& loop,
             const MakeStage& make, const TrainOptions& options = {});

}  // namespace restage
