// Closed surface of an implicit function by naive surface nets (Gibson 1998) on a rectilinear grid.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

/// Grid lines per axis, ascending; the surface must lie inside.
using GridLines = std::array<std::vector<double>, 3>;

struct SurfaceMesh {
  std::vector<Vec3> vertices;
  std::vector<Triangle> faces;  ///< counter-clockwise seen from outside
};

/// Surface field = 0 (negative inside). Signs are first made well-composed (no two inside nodes
/// that touch only over a diagonal), so the result is a closed, consistently oriented 2-manifold
/// for every field. The field may be sampled sparsely where its value exceeds 1.7 times the
/// distance that a block of nodes spans, so it should be near a distance.
SurfaceMesh surface_nets(const std::function<double(const Vec3&)>& field, const GridLines& grid);

/// Vertices joined by an edge, ascending.
std::vector<std::vector<int32_t>> vertex_neighbours(size_t vertices,
                                                    const std::vector<Triangle>& faces);

}  // namespace restage
