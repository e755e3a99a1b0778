// Training of skinning weights and pose-corrective offsets (spec 5.3; the paper's third stage).
#pragma once

#include "nn/losses/deformation.h"
#include "train/stage.h"
#include "train/stages/configs.h"

namespace restage {

class DeformationStage final : public Stage {
 public:
  /// Keeps references to both corpora.
  DeformationStage(const DeformationStageConfig& config, const Corpus& train,
                   const Corpus& validation, uint64_t seed);
  std::string name() const override { return "deformation"; }
  int64_t steps() const override { return config_.optimiser.steps; }
  int64_t examples_per_step() const override { return config_.optimiser.batch; }
  NamedValues step(int64_t step) override;
  void read(int64_t step) const override { batch(step); }
  NamedValues validate() override;
  void save(TensorFile& file) const override;
  void load(const TensorFile& file, const std::string& where) override;
  void export_models(ModelSet& set) override;

 private:
  PairBatch batch(int64_t step) const;
  DeformationBatch batch_of(const PairBatch& pairs) const;
  Var root_loss(Context& ctx, const DeformationBatch& batch) const;

  DeformationStageConfig config_;
  std::unique_ptr<Mlp3> weights_, offsets_, root_;
  Adam adam_;
  PairSampler sampler_, validation_sampler_;
  RngKey key_;
};

}  // namespace restage
