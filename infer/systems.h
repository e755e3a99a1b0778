// The systems by name. To add a system: derive a class from System and add a line to systems.cpp.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "infer/retargeter.h"
#include "nn/geometry/own_rig.h"

namespace restage {

/// Everything that a system may be made from.
struct SystemInput {
  Bundle weights;
  std::string weights_name;    ///< the file of `weights`, for errors
  Mesh target;                 ///< T-pose, metres, y up, facing +z
  std::string target_name;     ///< the file of `target`, for errors
  std::optional<Joints> rest;  ///< the target's rest joints, if they are known
  RetargetOptions options;
  /// A target with bones and a skin of its own: `target` and `rest` are those then.
  std::shared_ptr<const OwnRig> own = nullptr;
};

struct SystemType {
  std::string name, help;
  bool weights;  ///< whether the system needs SystemInput::weights
  std::unique_ptr<System> (*make)(SystemInput input);
};

const std::vector<SystemType>& systems();
/// A system of that type; where the target has a skin of its own, that poses its vertices.
std::unique_ptr<System> make_system(const SystemType& type, SystemInput input);
/// The system of that name. InputError, which suggests the nearest known name, if there is none;
/// `where`: the file in which the name stands.
const SystemType& system_type(const std::string& name, const std::string& where = "");

}  // namespace restage
