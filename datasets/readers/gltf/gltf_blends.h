// How skins turn and stretch what a file stores.
#pragma once

#include <vector>

#include "datasets/readers/gltf/gltf.h"

namespace restage {

/// Of each vertex, what takes a small move of it, as stored, to the world.
std::vector<Mat3> gltf_blends(const Gltf& file, const GltfTransforms& nodes);

}  // namespace restage
