// The training stages by name. A stage is a pair of files here (its config struct with a visit(), a
// class derived from Stage) and one line in registry.cpp.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "train/stage.h"
#include "train/stages/stage_input.h"

namespace restage {

struct StageType {
  std::string name, help;
  AnyConfig config;                  ///< at its defaults
  std::vector<std::string> roles;    ///< what it may leave in a bundle; the first always
  std::vector<std::string> figures;  ///< of validate(); lower is better
  /// Stages whose networks it needs, as it is configured; they are trained before.
  std::vector<std::string> (*reads)(const AnyConfig& config);
  std::unique_ptr<Stage> (*make)(const AnyConfig& config, const StageInput& input);
};

const std::vector<StageType>& stage_types();
std::vector<std::string> stage_names();
/// The first of these that is no STAGE.FIGURE; "" if all are.
std::string unknown_figure(const std::vector<std::string>& names);
/// InputError if there is no such stage.
const StageType& stage_type(const std::string& name);
/// What a stage would leave, from a weights file, run or artifact. InputError if it has no such.
Bundle networks_of(const StageType& stage, const std::string& path);

}  // namespace restage
