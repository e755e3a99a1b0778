// What `restage retarget` says it has recognised.
#pragma once

#include "datasets/importers/gltf_character.h"
#include "datasets/importers/skeleton_take.h"

namespace restage::cli {

/// A line on a character: "hero.vrm: VRM 1, VRM bones (55), A-pose turned into T-pose, 2 meshes, 4
/// morph targets"; of a rig that is not recognised what is missing. Then remarks; with --verbose
/// all that was found. Nothing for a plain mesh.
void say_target(const TargetMesh& target);
/// The same of a source's skeleton.
void say_take(const SkeletonTake& take);

}  // namespace restage::cli
