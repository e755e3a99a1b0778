// What a stage is given besides its configuration.
#pragma once

#include "autograd/base/rng.h"
#include "datasets/corpus.h"
#include "nn/config/rules.h"
#include "nn/losses/measure.h"
#include "nn/weights/bundle.h"
#include "train/artifacts/answers.h"

namespace restage {

inline EnumNames<Measure> config_names(Measure) {
  return {{"mse", Measure::mse}, {"distance", Measure::distance}};
}

/// The seed of one of a stage's samplers: it differs between samplers and between seeds of the
/// training, so that trainings of two seeds differ in what they see and not only in where they
/// begin.
inline uint64_t sampler_seed(uint64_t seed, std::string_view sampler) {
  const auto words = philox(RngKey{seed, 0}.fold(sampler), 0);
  return (uint64_t{words[0]} << 32) | words[1];
}

struct StageInput {
  const Corpus& train;       ///< kept by reference
  const Corpus& validation;  ///< kept by reference
  uint64_t seed = 0;
  const Bundle& given;  ///< networks of the stages that this stage reads
  /// Where the answers of an extractor about the corpora are kept.
  std::optional<AnswerFolder> answers = {};
  Device device = {};  ///< where the stage's networks live and are trained
};

/// Settings with the joints that data and given networks have in common (common_definition()).
inline Settings with_joints(Settings settings, const StageInput& in) {
  const JointDefinition joints =
      common_definition({{in.train.joints, "data"},
                         {in.validation.joints, "data of validation"},
                         {joint_definition(in.given, "given weights"), "given weights"}});
  if (!joints.empty()) settings[kJointsSetting] = joints;
  return settings;
}

}  // namespace restage
