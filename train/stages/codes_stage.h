// Training of H4D: codes of a window of clouds, learnt through the body that is made of them
// (spec 9.3). A network with an auxiliary code begins with the first stage alone.
#pragma once

#include "datasets/sampling/code_windows.h"
#include "nn/models/h4d.h"
#include "train/stages/supervised_stage.h"

namespace restage {

template <class V>
void visit(V& v, CodeWindowConfig& c) {
  v("points", c.points, "of a cloud, uniform by area", between(1, kMostPoints));
  v("heading", c.heading, "windows are turned by up to so many degrees", between(0, 180));
  v("frame_step", c.frame_step, "frames of the motion from one of a window to the next",
    between(1, 100000));
}

struct CodesLossConfig {
  double vertices = 1, shape = 1, rest_shape = 1;
};

template <class V>
void visit(V& v, CodesLossConfig& c) {
  v("vertices", c.vertices, "weight of the mean difference of vertex coordinates", at_least(0));
  v("shape", c.shape, "weight of the length of the difference of shapes", at_least(0));
  v("rest_shape", c.rest_shape,
    "weight of the same for the shape seen in a cloud of the T-pose, which a target is; 0: H4D",
    at_least(0));
}

struct CodesStageConfig {
  ModelChoice model{"codes/h4d"};
  OptimiserConfig optimiser;
  CodeWindowConfig windows;
  CodesLossConfig loss;
  int64_t vertices = 0, basis_windows = 1000, steps_per_batch = 1, aux_from = 0;
  int64_t validation_windows = 60;
};

template <class V>
void visit(V& v, CodesStageConfig& c) {
  visit_choice(v, c.model);
  v("optimiser", c.optimiser, "steps, batch, rate");
  v("windows", c.windows, "what is seen; sizes.frames says how long windows are");
  v("loss", c.loss, "weights of the losses");
  v("vertices", c.vertices, "of the body that the loss looks at; 0: all", between(0, 1e6));
  v("basis_windows", c.basis_windows, "windows whose motions the basis of motions is made of",
    between(2, 1e6));
  v("steps_per_batch", c.steps_per_batch, "optimiser steps in a row on the same examples",
    between(1, 1000));
  v("aux_from", c.aux_from, "first step of the second stage, in a network with sizes.aux",
    added("0", at_least(0)));
  v("validation_windows", c.validation_windows, "held-out windows per validation", between(1, 1e6));
}

class CodesStage final : public SupervisedStage<CodeWindowSampler> {
 public:
  using Config = CodesStageConfig;
  static std::vector<std::string> reads(const Config&) { return {}; }
  CodesStage(const Config& config, const StageInput& input);
  NamedValues step(int64_t step) override;
  NamedValues validate() override;
  std::vector<std::string> figures() override { return {"distance_mm", "shape_mm"}; }
  std::vector<Shown> show() override;

 private:
  /// What the codes mean, as the losses need it, on the stage's device.
  struct Meaning {
    LinearBody body;  ///< of the vertices that the loss looks at
    MotionBasis basis;
    Tensor shapes;  ///< [bodies, shape]: true ones of the training's bodies, on the host
  };
  struct Made {
    Var vertices;     ///< [n, t, v, 3]
    Var shape, rest;  ///< [n, shape]: of the window, and of the T-pose if it is asked for
  };
  H4d* make_network(const Config& config, const StageInput& input);
  const Meaning& meaning();
  /// `corrected`: by the auxiliary code, if the network has one.
  Made make(Context& ctx, const CodeWindowBatch& there, bool rest, bool corrected) const;
  CodeWindowBatch taken_there(const CodeWindowBatch& here) const override;
  Var loss(Context& ctx, const CodeWindowBatch& there, int64_t step, Tensor* answer) const override;
  Tensor truth(const CodeWindowBatch& here) const override { return here.truth; }
  void load_more(const TensorFile&, const std::string&) override { meaning_.reset(); }

  Config config_;
  const Corpus &train_, &validation_;
  H4d* model_;
  // Weights may be loaded after the constructor, and they bring their own; so this is made of the
  // network's buffers when a step or a validation first needs it.
  std::optional<Meaning> meaning_;
};

}  // namespace restage
