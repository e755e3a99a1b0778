// A stage is what is optimised and how; the loop around it is the trainer's (trainer.h).
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "nn/module.h"
#include "nn/weights/bundle.h"
#include "nn/weights/state.h"

namespace restage {

using NamedValues = std::vector<std::pair<std::string, double>>;

class Stage {
 public:
  virtual ~Stage() = default;
  virtual std::string name() const = 0;
  virtual int64_t steps() const = 0;
  /// Clouds, windows or pairs of bodies in a step.
  virtual int64_t examples_per_step() const = 0;
  /// Optimiser step number `step` (from 0). Everything random is a function of (seed, step), so a
  /// resumed run repeats the same bits. Returns what to log.
  virtual NamedValues step(int64_t step) = 0;
  /// Draws the examples of that step and forgets them: what reading alone costs (bench/README.md).
  virtual void read(int64_t step) const = 0;
  /// Held-out figures by the evaluation's own metrics.
  virtual NamedValues validate() = 0;
  /// All that a checkpoint needs: models, optimisers, anything carried from step to step.
  virtual void save(TensorFile& file) const = 0;
  virtual void load(const TensorFile& file, const std::string& where) = 0;
  /// Hands the trained models over (after the last step).
  virtual void export_models(ModelSet& set) = 0;
};

/// One differentiation: runs `loss` on a fresh tape in training mode and returns the gradients of
/// its first result. If loss or gradient is not finite the same step is repeated under FiniteCheck,
/// which names the op and module where the first such value appears (NonFiniteError).
struct Differentiated {
  Gradients gradients;
  double loss = 0, norm = 0;
};
Differentiated differentiate(const RngKey& key, const std::function<Var(Context&)>& loss);

}  // namespace restage
