// Texture coordinates for a mesh that has none.
#pragma once

#include <array>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

struct Atlas {
  /// 0 to 1, from the picture's lower left corner, as OBJ files have them.
  std::vector<Eigen::Vector2f> places;
  std::vector<std::array<int32_t, 3>> corners;  ///< of each face, numbers of places
};

/// Faces that look the same way (along an axis), hang together and belong to one part of the body
/// become a chart, which is their projection along that axis. No two charts overlap, nor does a
/// chart overlap itself, at `size` texels; charts lie some texels apart, and all have one scale.
/// `parts`: of each vertex a number; empty: all are one part. `mesh` must have faces. The same
/// input gives the same bits.
Atlas make_atlas(const Mesh& mesh, const std::vector<int>& parts = {}, int size = 1024);

/// Of each texel of a picture of `size` rows the face whose surface it shows, or -1; rows from the
/// top.
std::vector<int32_t> atlas_faces(const Atlas& atlas, int size);

}  // namespace restage
