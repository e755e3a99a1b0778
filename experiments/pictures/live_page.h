// The page on which a target is seen while it moves.
#pragma once

#include <string>

#include "nn/geometry/body.h"

namespace restage {

/// The page that live::PageServer serves for `rest`, the surface or cloud of the file `path` as a
/// system moves it: read_target()'s vertices and faces. It has the materials and pictures of glTF
/// and FBX, as read_showing() gives them.
std::string live_page(const std::string& path, const Mesh& rest);

}  // namespace restage
