// What stages have in common whose examples come with the answers.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "nn/losses/measure.h"
#include "nn/models/own_training.h"
#include "train/ahead.h"
#include "train/stage.h"
#include "train/stages/stage_input.h"

namespace restage {

/// All that is known of examples, as a loss of a network's own gets it.
template <class Batch>
NamedVars as_vars(const Batch& batch) {
  NamedVars out;
  for (const auto& [name, tensor] : named_tensors(batch)) out.emplace_back(name, Var(tensor));
  return out;
}

/// A stage that learns from what a sampler gives: `batch(first, n)` are examples number `first` to
/// `first` + n - 1. A class that derives from it adds its networks, calls begin() at the end of its
/// constructor, and says what the loss is.
template <class Sampler>
class SupervisedStage : public Stage {
 public:
  using Batch = decltype(std::declval<const Sampler&>().batch(0, 1));

  NamedTensors examples(int64_t step) const override { return named_tensors(batch(step)); }

  NamedValues step(int64_t step) override {
    const Differentiated d = parts(*optimiser_, [&](const MicroBatch& part) {
      Batch here =
          ahead_.take(may_draw_ahead(), step, part, [this](auto... of) { return batch(of...); });
      complete(step, part, &here);
      const Batch there = taken_there(here);
      Tensor answer;
      Differentiated out =
          differentiate(part.key(key_.fold(static_cast<uint64_t>(step))),
                        [&](Context& ctx) { return loss(ctx, there, step, &answer); });
      if (answer.defined()) out.values = {mean_distance(answer.cpu(), truth(here))};
      return out;
    });
    optimiser_->step(d.gradients, rate(step), step);
    const std::pair<std::string, double> second = d.values.empty()
                                                      ? std::pair{"gradient_norm", d.norm}
                                                      : std::pair{"distance_mm", 1e3 * d.values[0]};
    return {{"loss", d.loss}, second, {"rate", rate(step)}};
  }

 protected:
  SupervisedStage(const std::string& name, const OptimiserConfig& optimiser, const StageInput& in)
      : Stage(name, optimiser, in.device), key_(RngKey{in.seed, 0}.fold(name + ".step")) {}

  /// Makes the optimiser of the networks that have these roles. `steps_per_batch`: so many steps in
  /// a row have the same examples.
  void begin(const std::vector<std::string>& roles, int64_t steps_per_batch = 1) {
    optimiser_ = add_optimiser("optimiser", roles, optimisation_);
    steps_per_batch_ = steps_per_batch;
  }

  /// The examples of a step or of one of its micro-batches, in the host's memory.
  Batch batch(int64_t step, const MicroBatch& part = {}) const {
    return sampler_->batch(first_of(step, part), part.count(examples_per_step()));
  }
  /// The number of the first of them.
  int64_t first_of(int64_t step, const MicroBatch& part) const {
    const int64_t n = examples_per_step();
    return part.from(drawn(step) / steps_per_batch_ * n, n);
  }

  /// The learning rate of a step.
  double rate(int64_t step) const { return learning_rate(optimisation_.schedule, step, steps()); }

  /// Adds to drawn examples what the networks themselves say.
  virtual void complete(int64_t /*step*/, const MicroBatch&, Batch*) const {}
  /// The examples on the stage's device.
  virtual Batch taken_there(const Batch& here) const { return moved(here, device()); }
  /// The loss of examples on the device. `answer`: what the network answers, if its distance to
  /// truth() is to be logged. Several threads may call it at once.
  virtual Var loss(Context& ctx, const Batch& there, int64_t step, Tensor* answer) const = 0;
  virtual Tensor truth(const Batch& /*here*/) const { return {}; }

  const RngKey key_;                           ///< of everything random in steps
  std::optional<Sampler> sampler_, held_out_;  ///< made by the constructor that derives
  Optimiser* optimiser_ = nullptr;

 private:
  int64_t steps_per_batch_ = 1;
  Ahead<Batch> ahead_;  // below what it draws with
};

}  // namespace restage
