// Training of the motion retargeting network by cycle, adversarial, rotation and smoothness losses
// (spec 4; the paper's second stage).
#pragma once

#include "datasets/sampling/windows.h"
#include "nn/losses/motion.h"
#include "train/stage.h"
#include "train/stages/stage_input.h"

namespace restage {

template <class V>
void visit(V& v, MotionWeights& c) {
  v("cycle", c.cycle, "joints and translation after A -> B -> A", at_least(0));
  v("adversarial", c.adversarial, "the discriminator's judgement of B; 0: no discriminator",
    at_least(0));
  v("rotation", c.rotation, "rotations after A -> B -> A against the data's", at_least(0));
  v("smoothness", c.smoothness, "frame differences after A -> B -> A", at_least(0));
  v("self", c.self, "reconstruction of self samples", at_least(0));
  v("self_rotation", c.self_rotation, "rotations of self samples against the data's", at_least(0));
  v("twist", c.twist, "NKN's twist limit", at_least(0));
}

inline EnumNames<Translation> config_names(Translation) {
  return {{"velocity", Translation::velocity},
          {"relative", Translation::relative},
          {"absolute", Translation::absolute}};
}

template <class V>
void visit(V& v, WindowConfig& c) {
  v("frames", c.frames, "frames per window", at_least(2));
  v("self_share", c.self_share, "part of the samples whose target is A itself", between(0, 1));
  v("noise", c.noise, "Gaussian noise on input joints, metres", at_least(0));
  v("noise_correlation", c.noise_correlation, "of one frame's noise with the next's", below(0, 1));
  v("noisy_translation", c.noisy_translation, "noise of the pelvis also in the translation");
  v("heading", c.heading, "turn windows by any angle about y");
  v("mirror", c.mirror, "every second window mirrored");
  v("per_motion", c.per_motion, "every motion as likely (else every frame)");
  v("translation", c.translation, "velocity, relative or absolute");
  v("remove_heading", c.remove_heading, "turn every frame to face +z before the network");
}

/// The defaults are what trains; configs/paper/as_printed.yaml keeps the paper's letter
/// (docs/method.md).
struct MotionStageConfig {
  ModelChoice model{"smrm/rot6d"};
  OptimiserConfig optimiser;
  WindowConfig windows{.self_share = 0.7, .remove_heading = true};
  MotionWeights weights{.adversarial = 0.001, .rotation = 1};
  AdamConfig discriminator_adam;
  double balance_limit = 0.3;
  bool self_first_pass = true;
  int64_t validation_windows = 64, validation_frames = 60;
};

template <class V>
void visit(V& v, MotionStageConfig& c) {
  visit_choice(v, c.model);
  v("optimiser", c.optimiser, "steps, batch, rate");
  v("windows", c.windows, "how training windows are made");
  v("weights", c.weights, "of the loss terms");
  v("discriminator_adam", c.discriminator_adam, "the discriminator's optimiser");
  v("balance_limit", c.balance_limit,
    "the discriminator rests while its running score of fakes is below this", between(0, 1));
  v("self_first_pass", c.self_first_pass,
    "self samples do one supervised pass A -> A instead of the cycle");
  v("validation_windows", c.validation_windows, "held-out windows per validation", positive());
  v("validation_frames", c.validation_frames, "frames of each", at_least(3));
}

class MotionStage final : public Stage {
 public:
  using Config = MotionStageConfig;
  MotionStage(const Config& config, const StageInput& input);
  NamedValues step(int64_t step) override;
  void read(int64_t step) const override { batch(step); }
  /// Errors against the true motion of B, as the evaluation measures them, and the two losses whose
  /// drifting apart shows B becoming a hidden code for A.
  NamedValues validate() override;

 private:
  /// Windows of a step: for the cycle, and self samples apart; either may be undefined.
  struct Batch {
    int64_t cycle = 0, self = 0;  ///< how many
    WindowBatch windows, own;
  };
  Batch batch(int64_t step) const;
  MotionStatistics statistics() const;
  /// Discriminator's own step, unless it is winning clearly (spec 4.4).
  void update_discriminator(int64_t step, const WindowBatch& batch, double rate,
                            NamedValues* values);
  void save_more(TensorFile& file) const override;
  void load_more(const TensorFile& file, const std::string& where) override;

  Config config_;
  MotionModel* model_;
  Discriminator* discriminator_;
  Adam *adam_, *discriminator_adam_;
  WindowSampler sampler_, self_sampler_, validation_sampler_;
  RngKey key_;
  double balance_ = 0.5;
};

}  // namespace restage
