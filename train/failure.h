// A step whose loss was not finite, on disk: enough to repeat it anywhere the data are.
#pragma once

#include <string>

#include "nn/weights/bundle.h"
#include "train/stage.h"

namespace restage {

struct Failure {
  std::string stage, said;  ///< what differentiate() found: op and module
  int64_t step = 0;         ///< number of the step that failed, from 0
  int64_t from = 0;         ///< steps that `state` has behind it
  std::string config_yaml;  ///< the configuration of the run, resolved
  TensorFile state = {};    ///< Stage::save() of the last checkpoint; empty: as the stage is made
  NamedTensors examples;    ///< the examples of the step that failed
  Bundle given;             ///< what earlier stages have left
};

/// Writes a failure as one safetensors file, which appears whole or not at all.
void write_failure(const std::string& path, const Failure& failure);
/// InputError: there is no such file, or the file holds something else.
Failure read_failure(const std::string& path);

}  // namespace restage
