// A stage is what is optimised and how; the loop around it is the trainer's (trainer.h). A stage
// enters its networks and optimisers once, and saving, loading, starting from other weights and
// handing on follow from that.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "autograd/base/interrupt.h"
#include "nn/geometry/body.h"
#include "nn/module.h"
#include "nn/weights/bundle.h"
#include "nn/weights/state.h"
#include "train/gradient_noise.h"
#include "train/model_choice.h"
#include "train/optim/optimiser.h"
#include "train/team.h"

namespace restage {

class GradientWatch;

using NamedValues = std::vector<std::pair<std::string, double>>;

/// A row of a picture: clouds or skeletons, one a column. World metres or centred.
struct Shown {
  std::string label;
  std::vector<Points> clouds;
  std::vector<Joints> skeletons = {};
};
/// The clouds of x [..., v, 3] with these numbers.
Shown clouds_of(const std::string& label, const Tensor& x, const std::vector<int64_t>& numbers);
/// The skeletons of x [..., 22, 3] with these numbers.
Shown skeletons_of(const std::string& label, const Tensor& x, const std::vector<int64_t>& numbers);
/// `n` numbers from `first` on, `every` apart.
std::vector<int64_t> spaced(int64_t n, int64_t first = 0, int64_t every = 1);
/// How many examples a row shows, of `n`.
inline int64_t shown_of(int64_t n) { return std::min<int64_t>(8, n); }

/// Calls work(first, count) for `n` held-out examples, at most `most` of them at once. Interrupted
/// if a stop is asked for in between.
template <class Work>
void in_validation(int64_t n, int64_t most, Work&& work) {
  for (int64_t first = 0; first < n; first += most) {
    throw_if_stopped();
    work(first, std::min(most, n - first));
  }
}

/// One differentiation: runs `loss` on a fresh tape in training mode and returns the gradients of
/// its first result. If loss or gradient is not finite the same step is repeated under FiniteCheck,
/// which names the op and module where the first such value appears (NonFiniteError).
struct Differentiated {
  Gradients gradients;
  double loss = 0, norm = 0;
  /// Further numbers that a stage wants, each a mean over the examples.
  std::vector<double> values = {};
};
Differentiated differentiate(const RngKey& key, const std::function<Var(Context&)>& loss);

/// A micro-batch: number `index` of the `of` parts that the examples of a step are cut into.
struct MicroBatch {
  int64_t index = 0, of = 1;
  int64_t count(int64_t batch) const { return batch / of; }
  /// The number of its first example, where the examples of the step begin at number `first`.
  int64_t from(int64_t first, int64_t batch) const { return first + index * count(batch); }
  /// The key of everything random in the micro-batch.
  RngKey key(const RngKey& step) const {
    return of == 1 ? step : step.fold("part").fold(static_cast<uint64_t>(index));
  }
};

class Stage {
 public:
  /// The networks and optimisers of the stage live on `device`; examples are made in the host's
  /// memory.
  Stage(std::string name, OptimiserConfig optimiser, Device device = {})
      : optimisation_(std::move(optimiser)), name_(std::move(name)), device_(device) {}
  virtual ~Stage() = default;
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

  const std::string& name() const { return name_; }
  int64_t steps() const { return optimisation_.steps; }
  Device device() const { return device_; }  ///< where its networks are
  /// How many examples a step has: clouds, windows or pairs of bodies.
  int64_t examples_per_step() const { return optimisation_.batch; }
  /// Lets the same examples come again every `batches` steps, to see whether the stage can learn
  /// them by heart. 0: never.
  void repeat_batches(int64_t batches) { repeated_ = batches; }
  /// Cuts every step into micro-batches, of which each process of a team computes some
  /// (docs/training.md, "Several processes"). InputError: the number of micro-batches does not
  /// divide the batch, or the number of processes does not divide the number of micro-batches.
  void cut_steps(int64_t micro_batches, Team& team);
  /// Optimiser step number `step` (from 0). Everything random is a function of (seed, step), so a
  /// resumed run repeats the same bits. Returns what to log.
  virtual NamedValues step(int64_t step) = 0;
  /// The examples of step number `step`, as the losses read them.
  virtual NamedTensors examples(int64_t step) const = 0;
  /// Figures of held-out examples, by the metrics of the evaluation. Interrupted if a stop is asked
  /// for between two of them (throw_if_stopped()).
  virtual NamedValues validate() = 0;
  /// The names of those figures with this configuration, in their order. Empty: not known before
  /// the first validation.
  virtual std::vector<std::string> figures() { return {}; }
  /// validate(), and the figures that its networks bring with them (nn/models/own_training.h).
  NamedValues measure();
  /// The names of the latter.
  std::vector<std::string> own_figures() const;

  /// Held-out examples with what the stage makes of them, at most three rows; may be empty.
  virtual std::vector<Shown> show() { return {}; }

  /// All that a checkpoint needs: networks, optimisers, anything carried from step to step.
  virtual void save(TensorFile& file) const;
  virtual void load(const TensorFile& file, const std::string& where);
  /// Takes tensors of trained weights in the place of random ones: the tensors whose names in a
  /// weights file ("smrm.enc.weight_ih_l0") match one of `names`, where * stands for any text. The
  /// settings stay those of the stage; if the weights have others, the log warns. InputError naming
  /// `where`: a pattern that matches nothing, a tensor that is missing or does not fit.
  void start_from(const Bundle& weights, const std::vector<std::string>& names,
                  const std::string& where);
  bool started_from_weights() const { return started_from_weights_; }
  bool wants_muon() const { return optimisation_.kind == OptimiserConfig::Kind::muon; }
  /// How many numbers its optimisers leave to Muon and to the other rule, and how many stay.
  OptimisedNumbers optimised() const;
  /// Whether a parameter never moves (optimiser.groups).
  bool frozen(uint64_t id) const;
  /// Parameters and buffers of all networks, under the names of a checkpoint.
  std::vector<StateEntry> state() const;
  /// From now on shows the gradients of every step to `watch` (null: to nobody).
  void show_gradients(GradientWatch* watch) { watch_ = watch; }
  /// Has the steps measure how much gradients of micro-batches differ. InputError: a step is not
  /// cut into several (cut_steps()).
  void measure_noise();
  /// Figures of that, after the steps so far; empty if it is not measured.
  NamedValues noise() const;
  /// The networks to be used later, by role. If the stage works in the host's memory they are
  /// shared with it, else they are copies in the host's memory.
  virtual Bundle result() const;
  /// The parameters and buffers of the networks to be used later, under the names of a checkpoint.
  virtual std::vector<StateEntry> weights() const;

 protected:
  /// Builds a network that the stage trains. `handed_on`: the network is needed after the training.
  template <class M>
  M* add_network(const std::string& role, const std::string& model, const AnyConfig& sizes,
                 const RngKey& key, Settings settings = {}, bool handed_on = true) {
    auto net = make_model_as<M>(model, sizes, Init{key, DType::f32});
    move_module(*net, device_);
    networks_.push_back({role, {model, sizes, net, std::move(settings)}, handed_on});
    return net.get();
  }
  /// Notes a setting of a network that is known later than the network.
  void set(const std::string& role, const std::string& setting, const std::string& value) {
    for (Network& n : networks_)
      if (n.role == role) n.model.settings[setting] = value;
  }
  template <class M>
  M* add_network(const ModelChoice& choice, const RngKey& key, Settings settings = {}) {
    return add_network<M>(choice.role, choice.name, choice.sizes, key, std::move(settings));
  }
  /// Makes an optimiser of the networks that have these roles.
  Optimiser* add_optimiser(const std::string& name, const std::vector<std::string>& roles,
                           const OptimiserConfig& config);
  /// Saves and loads whatever else is carried from step to step.
  virtual void save_more(TensorFile&) const {}
  virtual void load_more(const TensorFile&, const std::string& /*where*/) {}

  Team& team() const { return *team_; }
  int64_t micro_batches() const { return micro_batches_; }
  /// The mean of what `compute` gives for each micro-batch of a step, also for the micro-batches of
  /// other processes. `optimiser` says whose gradients count: its parameters'. A micro-batch in
  /// which a parameter takes no part counts as a gradient of zero; a parameter that takes part in
  /// none of them has no gradient. Where no network has buffers that a pass changes, micro-batches
  /// are computed side by side on groups of threads, so several threads may call `compute` at once.
  Differentiated parts(const Optimiser& optimiser,
                       const std::function<Differentiated(const MicroBatch&)>& compute);

  /// Whether a GPU computes a step, so that the host may draw the next (train/ahead.h).
  bool may_draw_ahead() const;
  /// The number of the step whose examples are drawn in step number `step`.
  int64_t drawn(int64_t step) const { return repeated_ > 0 ? step % repeated_ : step; }

  const OptimiserConfig optimisation_;

 private:
  struct Network {
    std::string role;
    TrainedModel model;
    bool handed_on;
  };
  struct NamedOptimiser {
    std::string name;
    std::unique_ptr<Optimiser> optimiser;
  };
  Differentiated summed(const Optimiser& optimiser,
                        const std::function<Differentiated(const MicroBatch&)>& compute);

  std::string name_;
  Device device_;
  int64_t repeated_ = 0, micro_batches_ = 1;
  Team* team_ = &alone();
  bool started_from_weights_ = false;
  std::vector<Network> networks_;
  std::vector<NamedOptimiser> optimisers_;
  GradientWatch* watch_ = nullptr;
  std::optional<GradientNoise> noise_;  ///< of the first optimiser
};

}  // namespace restage
