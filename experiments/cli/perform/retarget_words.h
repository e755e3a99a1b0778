// What `restage retarget` says it has recognised.
#pragma once

#include <vector>

#include "datasets/importers/motions/skeleton_take.h"
#include "datasets/importers/rigs/gltf_character.h"

namespace restage::cli {

/// A line on a character: "hero.vrm: VRM 1, VRM bones (55), A-pose turned into T-pose, 2 meshes, 4
/// morph targets"; of a rig that is not recognised what is missing. Then remarks; with --verbose
/// all that was found. Nothing for a plain mesh.
void say_target(const TargetMesh& target);
/// The same of a source's skeleton.
void say_take(const SkeletonTake& take);
/// A warning if the networks are unsure of most frames: `confidence` of every frame that has one.
/// Balls, boxes and furniture are told from people so; an arm or a head alone mostly is not.
void warn_if_unsure(const std::string& source, std::vector<double> confidence);

}  // namespace restage::cli
