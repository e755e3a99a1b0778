// Finds a person in a tree of bones, by what the bones are called and how they hang together
// (profiles/README.md). No family of skeletons is known here.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "datasets/importers/rigs/bone_tree.h"

namespace restage {

struct FoundJoints {
  Bones bones{};
  std::vector<int> missing;  ///< needed joints that were not found; empty: a whole person
  std::string why;           ///< where more is known than that they are missing
};

/// The person below the bone `top` (-1: anywhere). Only what is certain is answered: where two
/// bones fit equally well or limbs do not hang together, joints are missing.
FoundJoints find_joints(const BoneTree& tree, int top);

/// `listed` with what it leaves out: joints of spine, neck and collars that are `open` (not listed,
/// and with no place of their own) where a bone lies that is theirs by how the listed ones hang
/// together. What carries the arms is spine3, as it is in find_joints().
Bones complete_joints(const BoneTree& tree, const Bones& listed,
                      const std::array<bool, kJoints>& open);

}  // namespace restage
