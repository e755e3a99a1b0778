// The training stages by name.
#pragma once

#include "train/stages/configs.h"

namespace restage {

/// "skeleton", "motion" or "deformation"; keeps references to the corpora.
std::unique_ptr<Stage> make_stage(const std::string& name, const TrainConfig& config,
                                  const Corpus& train, const Corpus& validation);

}  // namespace restage
