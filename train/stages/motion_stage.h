// Training of the motion retargeting network by cycle, adversarial, rotation and smoothness losses
// (spec 4; the paper's second stage).
#pragma once

#include <mutex>

#include "datasets/sampling/windows.h"
#include "nn/losses/motion.h"
#include "nn/models/own_training.h"
#include "train/ahead.h"
#include "train/artifacts/answers.h"
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
  v("acceleration", c.acceleration, "second differences after A -> B -> A", at_least(0));
  v("self", c.self, "reconstruction of self samples", at_least(0));
  v("self_rotation", c.self_rotation, "rotations of self samples against the data's", at_least(0));
  v("translation", c.translation, "the translation beside the joints, in cycle and self",
    at_least(0));
  v("twist", c.twist, "NKN's twist limit", at_least(0));
  v("contact", c.contact, "which feet stand, of a network that says it", at_least(0));
  v("path_smoothness", c.path_smoothness, "change of the path's velocity, of B and of A again (v1)",
    at_least(0));
  v("measure", c.measure, "mse (the papers) or distance: metres in the place of their squares");
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
  v("steady_heading", c.steady_heading, "that heading is an average of the last frames");
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
  double paired_share = 0;
  AnswersConfig answers;
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
  v("paired_share", c.paired_share,
    "part of that pass whose target is another body, of which the data knows the answer",
    between(0, 1));
  v("answers", c.answers, "what the network sees of A: an extractor's answers to clouds");
  v.check("weights", !(c.weights.acceleration > 0) || c.windows.frames > 2,
          "asks for accelerations of windows of two frames", "give windows.frames of 3 or more");
  v.check("windows", c.answers.tracks.sequences == 0 || c.windows.frames <= c.answers.tracks.frames,
          "is of more frames than an answer has (answers.frames)",
          "give windows.frames of at most that");
  v("validation_windows", c.validation_windows, "held-out windows per validation", between(1, 1e6));
  v("validation_frames", c.validation_frames, "frames of each", between(3, 1e6));
}

class MotionStage final : public Stage {
 public:
  using Config = MotionStageConfig;
  static std::vector<std::string> reads(const Config& config);
  /// An extractor is asked about few sequences, since all would take minutes.
  static double shorten(Config& config);
  MotionStage(const Config& config, const StageInput& input);
  NamedValues step(int64_t step) override;
  NamedTensors examples(int64_t step) const override;
  /// Errors against the true motion of B, as the evaluation measures them, and the two losses whose
  /// drifting apart shows B becoming a hidden code for A.
  NamedValues validate() override;
  std::vector<std::string> figures() override;
  std::vector<Shown> show() override;

 private:
  /// The windows of a step or a micro-batch: for the cycle, and self samples in a pass of their
  /// own. Either batch may be undefined.
  struct Batch {
    int64_t cycle = 0, self = 0;  ///< how many windows each has
    WindowBatch windows, own;
  };
  /// How many windows of a step are for the cycle, and how many are self samples in a pass of their
  /// own.
  int64_t cycle_windows() const;
  int64_t self_windows() const { return config_.optimiser.batch - cycle_windows(); }
  Batch batch(int64_t step, const MicroBatch& part = {}) const;
  using Drawn = std::function<const Batch&(const MicroBatch&)>;
  MotionStatistics statistics() const;
  /// The samplers of windows. They are made when they are first asked for, since an extractor may
  /// have to answer before.
  struct Windows;
  const Windows& windows() const;
  /// The step of the discriminator, which is left out while the discriminator is winning clearly
  /// (spec 4.4).
  void update_discriminator(const RngKey& step, double rate, const Drawn& batch,
                            NamedValues* values);
  /// The network's gradient on a micro-batch; its values are the losses cycle, rotation,
  /// smoothness, self and adversarial. `judged`: by the discriminator, too.
  Differentiated learn(const RngKey& key, const Batch& batch, bool judged);
  Var loss_of_own(Context& ctx, const OwnTraining& own, const Batch& batch) const;
  bool adversarial() const { return config_.weights.adversarial > 0; }
  void save_more(TensorFile& file) const override;
  void load_more(const TensorFile& file, const std::string& where) override;

  Config config_;
  MotionModel* model_;
  Discriminator* discriminator_;
  Optimiser *optimiser_, *discriminator_optimiser_;
  const Corpus &train_, &validation_;
  uint64_t seed_;
  Bundle given_;  ///< the extractor, if the motion network learns on its answers
  std::optional<AnswerFolder> answers_;
  RngKey key_;
  mutable std::once_flag asked_;
  mutable std::shared_ptr<const Windows> windows_;
  Ahead<Batch> ahead_;
  double balance_ = 0.5;
};

}  // namespace restage
