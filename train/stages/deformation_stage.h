// Training of skinning weights and pose-corrective offsets (spec 5.3; the paper's third stage).
#pragma once

#include "datasets/sampling/pairs.h"
#include "nn/losses/deformation.h"
#include "nn/models/deformation.h"
#include "train/stages/supervised_stage.h"

namespace restage {

template <class V>
void visit(V& v, PairConfig& c) {
  v("points", c.points, "points per pair", positive());
  v("joint_noise", c.joint_noise, "Gaussian noise on the rest joints that the networks see, metres",
    at_least(0));
  v("dressed", c.dressed, "part of the pairs whose rest points are seen in clothes", between(0, 1));
  v("heading", c.heading, "turn poses by any angle about y");
  v("mirror", c.mirror, "every second pair mirrored");
  v("frame_step", c.frame_step, "only every so many frames of a motion (30: one a second)",
    between(1, 100000));
}

struct DeformationStageConfig {
  ModelChoice model{"deformation/weights"};  ///< its sizes are the sizes of the offset network, too
  OptimiserConfig optimiser;
  PairConfig pairs;
  Measure loss = Measure::mse;
  int64_t skinning_steps = 0;
  double supervision = 0;
  bool offsets = true, keep_root_rotation = true;
  int64_t validation_pairs = 60;
};

template <class V>
void visit(V& v, DeformationStageConfig& c) {
  visit_choice(v, c.model);
  v("optimiser", c.optimiser, "steps, batch, rate");
  v("pairs", c.pairs, "how training pairs are made");
  v("loss", c.loss, "mse (the paper) or mean distance (its first version)");
  v("skinning_steps", c.skinning_steps, "first steps without offsets (the paper: one epoch)",
    at_least(0));
  v("supervision", c.supervision,
    "weight of the cross-entropy against the data's skin weights; 0: distances alone (the paper)",
    at_least(0));
  v("offsets", c.offsets, "train pose-corrective offsets");
  v("keep_root_rotation", c.keep_root_rotation, "offsets see the root's rotation (false: zero)");
  v("validation_pairs", c.validation_pairs, "held-out pairs per validation", between(1, 1e6));
}

class DeformationStage final : public SupervisedStage<PairSampler> {
 public:
  using Config = DeformationStageConfig;
  static std::vector<std::string> reads(const Config&) { return {}; }
  DeformationStage(const Config& config, const StageInput& input);
  NamedValues validate() override;
  std::vector<std::string> figures() override;
  std::vector<Shown> show() override;

 private:
  DeformationBatch batch_of(const PairBatch& pairs) const;
  Var loss(Context& ctx, const PairBatch& pairs, int64_t step, Tensor* posed) const override;
  Tensor truth(const PairBatch& here) const override { return here.posed_points; }

  Config config_;
  DeformationModel* weights_;
  OffsetNet* offsets_;  // null: none
};

}  // namespace restage
