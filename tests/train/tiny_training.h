// A training of all three stages that takes a moment: for tests of the stages and of the loop.
#pragma once

#include "tests/support/tiny_body.h"
#include "train/stages/registry.h"

namespace restage::testing {

/// Small networks on the bodies of boxes, with dropout, noise, discriminator and all.
inline TrainConfig tiny_training(int64_t steps) {
  TrainConfig c;
  c.seed = 7;
  c.skeleton.model = "skeleton/patch_transformer";
  c.skeleton.sizes.points = 96;
  c.skeleton.sizes.width = 32;
  c.skeleton.sizes.layers = 1;
  c.skeleton.sizes.centres = 24;
  c.skeleton.sizes.neighbours = 8;
  c.skeleton.vote_weight = 0.5;
  c.skeleton.segmentation_weight = 0.5;
  c.skeleton.validation_clouds = 4;
  c.motion.sizes.hidden = 16;
  c.motion.sizes.standardise = true;
  c.motion.windows.frames = 12;
  c.motion.windows.noise = 0.01;
  c.motion.windows.self_share = 0.25;
  c.motion.self_first_pass = false;
  c.motion.weights.adversarial = 0.01;
  c.motion.validation_windows = 2;
  c.motion.validation_frames = 12;
  c.deformation.pairs.points = 48;
  c.deformation.skinning_steps = steps / 3;
  c.deformation.root_net = true;
  c.deformation.validation_pairs = 2;
  for (OptimiserConfig* o :
       {&c.skeleton.optimiser, &c.motion.optimiser, &c.deformation.optimiser}) {
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
struct TinyCorpora {
  Corpus train = subset(tiny_corpus(), "train"), validation = subset(tiny_corpus(), "validation");
};
inline const TinyCorpora& tiny_corpora() {
  static const TinyCorpora corpora;
  return corpora;
}

inline std::unique_ptr<Stage> tiny_stage(const std::string& name, const TrainConfig& config) {
  return make_stage(name, config, tiny_corpora().train, tiny_corpora().validation);
}

/// All that a stage carries from step to step.
inline std::string bytes_of(const Stage& stage) {
  TensorFile file;
  stage.save(file);
  return safetensors_bytes(file);
}

}  // namespace restage::testing
