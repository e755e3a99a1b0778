// Training of the third MLP that the paper's count implies (spec 5.4, H1; docs/method.md): where
// the rest pelvis is, seen from the centroid of the rest points. No other stage needs it.
#pragma once

#include "datasets/sampling/pairs.h"
#include "nn/models/deformation.h"
#include "train/stage.h"
#include "train/stages/stage_input.h"

namespace restage {

struct RootStageConfig {
  ModelChoice model{"deformation/root"};
  OptimiserConfig optimiser;
  int64_t points = 1024;
  int64_t validation_bodies = 60;
};

template <class V>
void visit(V& v, RootStageConfig& c) {
  visit_choice(v, c.model);
  v("optimiser", c.optimiser, "steps, batch, rate");
  v("points", c.points, "points of a body", positive());
  v("validation_bodies", c.validation_bodies, "held-out bodies per validation", between(1, 1e6));
}

class RootStage final : public Stage {
 public:
  using Config = RootStageConfig;
  static std::vector<std::string> reads(const Config&) { return {}; }
  RootStage(const Config& config, const StageInput& input);
  NamedValues step(int64_t step) override;
  NamedTensors examples(int64_t step) const override;
  NamedValues validate() override;

 private:
  /// Mean squared distance, m^2 a coordinate.
  Var loss(Context& ctx, const PairBatch& bodies) const;

  Config config_;
  RootNet* net_;
  Optimiser* optimiser_;
  PairSampler sampler_, validation_sampler_;
  RngKey key_;
};

}  // namespace restage
