// Supervised training of a skeleton extractor (spec 2.1; the paper's first stage).
#pragma once

#include "datasets/sampling/evaluation.h"
#include "train/stage.h"
#include "train/stages/configs.h"

namespace restage {

class SkeletonStage final : public Stage {
 public:
  /// Keeps references to both corpora.
  SkeletonStage(const SkeletonStageConfig& config, const Corpus& train, const Corpus& validation,
                uint64_t seed);
  std::string name() const override { return "skeleton"; }
  int64_t steps() const override { return config_.optimiser.steps; }
  int64_t examples_per_step() const override { return config_.optimiser.batch; }
  NamedValues step(int64_t step) override;
  void read(int64_t step) const override { batch(step); }
  NamedValues validate() override;
  void save(TensorFile& file) const override;
  void load(const TensorFile& file, const std::string& where) override;
  void export_models(ModelSet& set) override;

 private:
  CloudBatch batch(int64_t step) const;
  Var loss(Context& ctx, const CloudBatch& batch) const;

  SkeletonStageConfig config_;
  std::unique_ptr<SkeletonModel> model_;
  Adam adam_;
  CloudSampler sampler_, validation_sampler_;
  std::vector<CloudSubject> posed_, tposes_;
  RngKey key_;
};

/// Mean joint distance of a model on given clouds, metres (evaluation mode).
double joint_error(SkeletonModel& model, const CloudBatch& clouds);

}  // namespace restage
