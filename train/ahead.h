// Examples of the next step, drawn while a GPU computes this one.
#pragma once

#include <future>

#include "train/phases.h"
#include "train/stage.h"

namespace restage {

/// The processor waits for the GPU at the end of every step; it may draw meanwhile. What is drawn
/// does not depend on it. Keep it below what `draw` uses: it waits for its thread when it goes.
template <class Batch>
class Ahead {
 public:
  /// draw(step, part). `ahead`: the next step's are drawn meanwhile, which makes no sense on the
  /// host's own cores. Steps in several micro-batches draw their own.
  template <class Draw>
  Batch take(bool ahead, int64_t step, const MicroBatch& part, Draw draw) {
    const PhaseScope drawing(Phase::draw);  // or waiting for what is drawn
    if (!ahead || part.of > 1) return draw(step, part);
    const bool ready = next_.valid() && next_step_ == step;
    if (next_.valid() && !ready) next_.wait();
    Batch out = ready ? next_.get() : draw(step, part);
    next_step_ = step + 1;
    next_ = std::async(std::launch::async, [=] { return draw(step + 1, MicroBatch{}); });
    return out;
  }

 private:
  int64_t next_step_ = 0;
  std::future<Batch> next_;
};

}  // namespace restage
