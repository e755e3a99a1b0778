// What a stage is given besides its configuration.
#pragma once

#include "datasets/corpus.h"
#include "nn/weights/bundle.h"

namespace restage {

struct StageInput {
  const Corpus& train;       ///< kept by reference
  const Corpus& validation;  ///< kept by reference
  uint64_t seed = 0;
  const Bundle& given;  ///< what the stages that it reads have left
};

}  // namespace restage
