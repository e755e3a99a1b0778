// The systems by name. A system is a class derived from System and one line in systems.cpp.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "infer/retargeter.h"

namespace restage {

/// What a system may be made from.
struct SystemInput {
  Bundle weights;
  std::string weights_name;    ///< for errors
  Mesh target;                 ///< T-pose, metres, y up, facing +z
  std::string target_name;     ///< for errors
  std::optional<Joints> rest;  ///< of the target, if they are known
  RetargetOptions options;
  std::optional<Joints> rig = std::nullopt;  ///< those that the target's rig shows (Retargeter)
};

struct SystemType {
  std::string name, help;
  bool weights;  ///< it needs some
  std::unique_ptr<System> (*make)(SystemInput input);
};

const std::vector<SystemType>& systems();
/// InputError with the nearest known name if there is no such system; `where` the name stands.
const SystemType& system_type(const std::string& name, const std::string& where = "");

}  // namespace restage
