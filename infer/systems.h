// The systems by name. To add a system: derive a class from System and add a line to systems.cpp.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "infer/retargeter.h"

namespace restage {

/// Everything that a system may be made from.
struct SystemInput {
  Bundle weights;
  std::string weights_name;    ///< the file of `weights`, for errors
  Mesh target;                 ///< T-pose, metres, y up, facing +z
  std::string target_name;     ///< the file of `target`, for errors
  std::optional<Joints> rest;  ///< the target's rest joints, if they are known
  RetargetOptions options;
  std::optional<Joints> rig =
      std::nullopt;  ///< the joints that the target's rig shows (Retargeter)
};

struct SystemType {
  std::string name, help;
  bool weights;  ///< whether the system needs SystemInput::weights
  std::unique_ptr<System> (*make)(SystemInput input);
};

const std::vector<SystemType>& systems();
/// The system of that name. InputError, which suggests the nearest known name, if there is none;
/// `where`: the file in which the name stands.
const SystemType& system_type(const std::string& name, const std::string& where = "");

}  // namespace restage
