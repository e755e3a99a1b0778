// The systems by name. To add a system: derive a class from System and add a line to systems.cpp,
// or register_system() from a program of one's own.
#pragma once

#include <deque>
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
  std::vector<std::string> roles = {};  ///< roles of SystemInput::weights that it reads
  /// Roles that only vertices need; without the first of them frames have none.
  std::vector<std::string> surface = {};
  bool parts = false;       ///< a Retargeter, whose networks can be judged one by one
  bool needs_rest = false;  ///< whether it needs SystemInput::rest
  bool each_cloud = false;  ///< answers each cloud, so the source must have 30 frames a second
  bool own_skin = true;     ///< gives joints, so that a target's own skin can pose its vertices
  std::unique_ptr<System> (*make)(SystemInput input);
};

const std::deque<SystemType>& systems();
/// Adds a system of a program that uses this library, before anything else is done. Error if there
/// is one of that name.
void register_system(SystemType type);
/// A system of that type; where the target has a skin of its own, that poses its vertices.
std::unique_ptr<System> make_system(const SystemType& type, SystemInput input);
/// The system of that name. InputError, which suggests the nearest known name, if there is none;
/// `where`: the file in which the name stands.
const SystemType& system_type(const std::string& name, const std::string& where = "");

}  // namespace restage
