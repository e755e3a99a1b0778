// The parameters of an optimiser, with the names under which their state is saved.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "nn/module.h"
#include "nn/weights/safetensors.h"

namespace restage {

struct NamedParameter {
  std::string name;  ///< "skeleton.layers.0.qkv.weight"
  Parameter* parameter;
};

/// The parameters of `modules`, each under its prefix.
std::vector<NamedParameter> named_parameters(
    const std::vector<std::pair<std::string, Module*>>& modules);

/// The saved state `name`, a copy on a device; InputError naming `where` if it is missing or of
/// another size.
Tensor saved_state(const TensorFile& file, const std::string& name, const Shape& shape,
                   const std::string& where, Device device = {});

}  // namespace restage
