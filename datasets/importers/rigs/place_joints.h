// Where joints go that a skeleton lacks: spine, neck, collars and toes (docs/formats.md has the
// table).
#pragma once

#include <functional>
#include <string>

#include "datasets/importers/motions/source_motion.h"
#include "datasets/importers/rigs/find_joints.h"

namespace restage {

/// The bone of this name, or -1.
using BoneFinder = std::function<int(const std::string&)>;

/// The joints of `bones`, and those that are -1 there by the profile's places, else by the general
/// rules. `profile` must outlive the result. InputError naming `where` for a foot whose direction
/// nothing tells.
NamedJoints place_joints(const BoneTree& tree, const BoneFinder& names, const Profile& profile,
                         const Bones& bones, const std::string& where);

}  // namespace restage
