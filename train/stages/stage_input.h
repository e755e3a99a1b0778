// What a stage is given besides its configuration.
#pragma once

#include "datasets/corpus.h"
#include "nn/config/rules.h"
#include "nn/losses/measure.h"
#include "nn/weights/bundle.h"

namespace restage {

inline EnumNames<Measure> config_names(Measure) {
  return {{"mse", Measure::mse}, {"distance", Measure::distance}};
}

struct StageInput {
  const Corpus& train;       ///< kept by reference
  const Corpus& validation;  ///< kept by reference
  uint64_t seed = 0;
  const Bundle& given;  ///< what the stages that it reads have left
};

}  // namespace restage
