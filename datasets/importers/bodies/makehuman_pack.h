// MakeHuman's published files as the one file that MakeHuman (makehuman.h) reads.
#pragma once

#include <string>

namespace restage {

/// Writes `out` (makehuman.h5, whole or not at all) from `folder`, which holds
///   base.obj                   base mesh in decimetres; faces of its group "body" are the skin
///   targets/**/*.target        shape targets, named by their paths below targets/
///   game_engine.mhskel         bones, and the vertices whose means are their heads
///   weights.game_engine.json   skinning weights
/// InputError naming file and line for what is missing or not of that kind. WorkError: disk full.
void pack_makehuman(const std::string& folder, const std::string& out);

}  // namespace restage
