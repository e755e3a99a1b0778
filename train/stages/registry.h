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
  AnyConfig config;  ///< the configuration with its defaults
  /// The roles that it may leave in a bundle; the first role always.
  std::vector<std::string> roles;
  std::vector<std::string> figures;  ///< figures of validate(); lower is better
  /// The stages whose networks this stage needs with such a configuration; they are trained before
  /// it.
  std::vector<std::string> (*reads)(const AnyConfig& config);
  std::unique_ptr<Stage> (*make)(const AnyConfig& config, const StageInput& input);
};

const std::vector<StageType>& stage_types();
std::vector<std::string> stage_names();
/// The first of `names` that is not STAGE.FIGURE of some stage; "" if there is none.
std::string unknown_figure(const std::vector<std::string>& names);
/// InputError if there is no such stage.
const StageType& stage_type(const std::string& name);
/// The networks that a stage would leave, taken from a weights file, run or artifact. InputError if
/// `path` has no such networks.
Bundle networks_of(const StageType& stage, const std::string& path);

}  // namespace restage
