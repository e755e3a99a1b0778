// Bones with the words of their names, and how they hang on each other.
#pragma once

#include <array>
#include <vector>

#include "datasets/importers/rigs/bone_words.h"
#include "datasets/readers/skeletons/skeleton_file.h"

namespace restage {

/// The bone of each of the 22 joints; -1: none.
using Bones = std::array<int, kJoints>;

/// `words` are those of undecorated() names, one for each bone of the skeleton.
struct BoneTree {
  const SourceSkeleton& skeleton;
  std::vector<BoneWords> words;
};

/// By the words of one of bone_dictionaries(); `plain` are the bones' undecorated() names. What may
/// be a finger or a toe is a toe where it hangs on a foot.
BoneTree bone_tree(const SourceSkeleton& skeleton, const std::vector<std::string>& plain,
                   size_t language);

/// Whether `bone` is `above` or hangs on it.
bool hangs_on(const SourceSkeleton& skeleton, int bone, int above);

/// Bones that carry a whole person each (two hands, two feet and a head hang below), as far down as
/// possible: two for two characters in one file.
std::vector<int> find_people(const BoneTree& tree);

/// The lowest bone that carries both; -1: there is none.
int carrier_of(const SourceSkeleton& skeleton, int a, int b);

/// The lowest bone that carries both arms (collars, else upper arms) and is not called neck. -1:
/// there is none.
int chest_of(const BoneTree& tree, const Bones& bones);

}  // namespace restage
