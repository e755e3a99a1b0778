// Training of the motion retargeting network by cycle, adversarial, rotation and smoothness losses
// (spec 4; the paper's second stage).
#pragma once

#include "train/stage.h"
#include "train/stages/configs.h"

namespace restage {

class MotionStage final : public Stage {
 public:
  /// Keeps references to both corpora.
  MotionStage(const MotionStageConfig& config, const Corpus& train, const Corpus& validation,
              uint64_t seed);
  std::string name() const override { return "motion"; }
  int64_t steps() const override { return config_.optimiser.steps; }
  int64_t examples_per_step() const override { return config_.optimiser.batch; }
  NamedValues step(int64_t step) override;
  void read(int64_t step) const override { batch(step); }
  /// Errors against the true motion of B, as the evaluation measures them, and the two losses whose
  /// drifting apart shows B becoming a hidden code for A.
  NamedValues validate() override;
  void save(TensorFile& file) const override;
  void load(const TensorFile& file, const std::string& where) override;
  void export_models(ModelSet& set) override;

 private:
  /// Windows of a step: for the cycle, and self samples apart; either may be undefined.
  struct Batch {
    int64_t cycle = 0, self = 0;  ///< how many
    WindowBatch windows, own;
  };
  Batch batch(int64_t step) const;
  void set_statistics();
  /// Discriminator's own step, unless it is winning clearly (spec 4.4).
  void update_discriminator(int64_t step, const WindowBatch& batch, double rate,
                            NamedValues* values);

  MotionStageConfig config_;
  std::unique_ptr<Smrm> model_;
  std::unique_ptr<Discriminator> discriminator_;
  Adam adam_, discriminator_adam_;
  WindowSampler sampler_, self_sampler_, validation_sampler_;
  RngKey key_;
  double balance_ = 0.5;
};

}  // namespace restage
