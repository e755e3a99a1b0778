// Recordings whose root is not the pelvis: it is the head, or the chest, and the hips hang on the
// spine (SlimeVR's are so).
#pragma once

#include "datasets/importers/rigs/profiles.h"
#include "datasets/readers/skeletons/bvh.h"

namespace restage {

/// The bone that carries the legs, if it hangs below what carries the arms, and the arms not on it;
/// -1: the skeleton hangs as usual, or nothing tells. By the names of `profile`, if there is one,
/// else by the words of names.
int hanging_pelvis(const SourceSkeleton& skeleton, const Profile* profile);

/// The same recording with this joint as its root. All joints between it and the old root hang on
/// it, one on the other; each keeps its turn in the world, and the bone that it had above it is now
/// below, turning with it. The old root stays where its channels put it. The file must have
/// positions of its root alone (has_root_positions_alone()).
BvhFile rerooted(const BvhFile& file, int root);
bool has_root_positions_alone(const BvhFile& file);

}  // namespace restage
