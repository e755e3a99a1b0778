// A training of all three stages that takes a moment: for tests of the stages and of the loop.
#pragma once

#include <gtest/gtest.h>

#include "autograd/base/interrupt.h"
#include "tests/support/tiny_body.h"
#include "tests/support/use_set.h"
#include "train/stages/deformation_stage.h"
#include "train/stages/motion_stage.h"
#include "train/stages/skeleton_stage.h"
#include "train/training/training.h"

namespace restage::testing {

inline SkeletonStageConfig& skeleton(TrainConfig& c) {
  return c.section("skeleton").config.as<SkeletonStageConfig>();
}
inline MotionStageConfig& motion(TrainConfig& c) {
  return c.section("motion").config.as<MotionStageConfig>();
}
inline DeformationStageConfig& deformation(TrainConfig& c) {
  return c.section("deformation").config.as<DeformationStageConfig>();
}
inline std::vector<OptimiserConfig*> optimisers(TrainConfig& c) {
  return {&skeleton(c).optimiser, &motion(c).optimiser, &deformation(c).optimiser};
}
/// Sizes of the chosen model, as configurations give them: "width=32".
inline void resize(ModelChoice& choice, const std::vector<std::string>& sizes) {
  ConfigNode tree = write_config(choice.sizes);
  for (const std::string& size : sizes) apply_override(tree, size);
  read_config(tree, choice.sizes);
}
inline void choose(ModelChoice& choice, const std::string& model,
                   const std::vector<std::string>& sizes) {
  choice = ModelChoice(model);
  resize(choice, sizes);
}

/// Small networks on the bodies of boxes, with dropout, noise, discriminator and all.
inline TrainConfig tiny_training(int64_t steps) {
  TrainConfig c;
  c.seed = 7;
  SkeletonStageConfig& s = skeleton(c);
  choose(s.model, "skeleton/patch_transformer",
         {"points=96", "width=32", "layers=1", "centres=24", "neighbours=8", "uncertainty=true",
          "memory=true"});
  s.clouds.remembered = 0.5;
  s.optimiser.kind = OptimiserConfig::Kind::muon;
  s.vote_weight = 0.5;
  s.segmentation_weight = 0.5;
  s.validation_clouds = 4;
  MotionStageConfig& m = motion(c);
  choose(m.model, "smrm/rot6d", {"hidden=16"});
  m.windows.frames = 12;
  m.windows.noise = 0.01;
  m.windows.self_share = 0.25;
  m.self_first_pass = false;
  m.weights.adversarial = 0.01;
  m.validation_windows = 2;
  m.validation_frames = 12;
  DeformationStageConfig& d = deformation(c);
  d.pairs.points = 48;
  d.skinning_steps = steps / 3;
  d.validation_pairs = 2;
  for (OptimiserConfig* o : optimisers(c)) {
    o->steps = steps;
    o->batch = 4;
    o->clip = 1;
    o->schedule.rate = 2e-3;
    o->schedule.kind = ScheduleConfig::Kind::cosine;
    o->schedule.warmup = 3;
  }
  return c;
}

/// The corpora of a training, made once.
inline const TrainingData& tiny_data() {
  static const TrainingData data = [] {
    TrainingData out;
    out.train = subset(tiny_corpus(), "train");
    out.validation = subset(tiny_corpus(), "validation");
    return out;
  }();
  return data;
}

inline std::unique_ptr<Stage> tiny_stage(const std::string& name, const TrainConfig& config,
                                         Bundle so_far = {}) {
  return make_stage(config, name, tiny_data(), &so_far);
}

inline double figure_of(const NamedValues& values, const std::string& name) {
  for (const auto& [key, value] : values)
    if (key == name) return value;
  ADD_FAILURE() << "no " << name;
  return 0;
}

/// All that a stage carries from step to step.
inline std::string result_bytes(const Stage& stage) {
  TensorFile file;
  stage.save(file);
  return safetensors_bytes(file);
}

/// All steps of a stage, with one thread and with several.
inline void expect_the_same_bits(const std::string& name, const TrainConfig& config) {
  std::string first;
  for (const int n : {1, 2, 3}) {
    const UseThreads use(n);
    const auto stage = tiny_stage(name, config);
    for (int64_t i = 0; i < stage->steps(); ++i) stage->step(i);
    stage->validate();  // must leave no trace
    if (n == 1) first = result_bytes(*stage);
    EXPECT_TRUE(result_bytes(*stage) == first) << name << " with " << n << " threads";
  }
}

/// A training that went through a file half way has the bits of one that did not.
inline void expect_to_resume(const std::string& name, const TrainConfig& config) {
  const auto straight = tiny_stage(name, config), resumed = tiny_stage(name, config);
  const int64_t all = straight->steps(), half = all / 2;
  for (int64_t i = 0; i < half; ++i) straight->step(i);
  const std::string bytes = result_bytes(*straight);
  for (int64_t i = half; i < all; ++i) straight->step(i);
  resumed->load(parse_safetensors(bytes, "half"), "half");
  EXPECT_TRUE(result_bytes(*resumed) == bytes) << name;
  for (int64_t i = half; i < all; ++i) resumed->step(i);
  EXPECT_TRUE(result_bytes(*resumed) == result_bytes(*straight)) << name;
}

/// A validation ends early where somebody asks to stop, and leaves no trace.
inline void expect_validation_to_stop(const std::string& name, const TrainConfig& config) {
  const auto stage = tiny_stage(name, config);
  const NamedValues whole = stage->validate();
  {
    const StopScope scope;
    ask_to_stop();
    EXPECT_THROW(stage->validate(), Interrupted) << name;
  }
  EXPECT_EQ(stage->validate(), whole) << name;
}

inline OptimiserConfig optimiser_of(const Stage& stage) {
  OptimiserConfig out;
  out.steps = stage.steps();
  out.batch = stage.examples_per_step();
  return out;
}

/// Hands everything on to another stage; tests change what they want to see.
class Forwarding : public Stage {
 public:
  explicit Forwarding(std::unique_ptr<Stage> stage)
      : Stage(stage->name(), optimiser_of(*stage)), stage_(std::move(stage)) {}
  NamedValues step(int64_t step) override { return stage_->step(step); }
  NamedTensors examples(int64_t step) const override { return stage_->examples(step); }
  NamedValues validate() override { return stage_->validate(); }
  void save(TensorFile& file) const override { stage_->save(file); }
  void load(const TensorFile& file, const std::string& where) override {
    stage_->load(file, where);
  }
  Bundle result() const override { return stage_->result(); }
  std::vector<StateEntry> weights() const override { return stage_->weights(); }

 private:
  std::unique_ptr<Stage> stage_;
};

}  // namespace restage::testing
