// Finds a person in a tree of bones, by what the bones are called and how they hang together
// (docs/design/rigs.md). No family of skeletons is known here.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "datasets/importers/bone_words.h"
#include "datasets/readers/skeleton_file.h"

namespace restage {

/// The bone of each of the 22 joints; -1: none.
using Bones = std::array<int, kJoints>;

struct FoundJoints {
  Bones bones{};
  std::vector<int> missing;  ///< needed joints that were not found; empty: a whole person
  std::string why;           ///< where more is known than that they are missing
};

/// `words` are those of undecorated() names, one for each bone of the skeleton.
struct BoneTree {
  const SourceSkeleton& skeleton;
  std::vector<BoneWords> words;
};

/// Whether `bone` is `above` or hangs on it.
bool hangs_on(const SourceSkeleton& skeleton, int bone, int above);

/// Bones that carry a whole person each (two hands, two feet and a head hang below), as far down as
/// possible: two for two characters in one file.
std::vector<int> find_people(const BoneTree& tree);

/// The person below the bone `top` (-1: anywhere). Only what is certain is answered: where two
/// bones fit equally well or limbs do not hang together, joints are missing.
FoundJoints find_joints(const BoneTree& tree, int top);

/// `listed` with what it leaves out: joints of spine, neck and collars that are `open` (not listed,
/// and with no place of their own) where a bone lies that is theirs by how the listed ones hang
/// together. What carries the arms is spine3, as it is in find_joints().
Bones complete_joints(const BoneTree& tree, const Bones& listed,
                      const std::array<bool, kJoints>& open);

/// The lowest bone that carries both; -1: there is none.
int carrier_of(const SourceSkeleton& skeleton, int a, int b);

/// The lowest bone that carries both arms (collars, else upper arms) and is not called neck. -1:
/// there is none.
int chest_of(const BoneTree& tree, const Bones& bones);

}  // namespace restage
