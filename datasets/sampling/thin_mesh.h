// A mesh of fewer vertices, which are vertices of the whole mesh.
#pragma once

#include <vector>

#include "nn/geometry/body.h"

namespace restage {

struct ThinMesh {
  std::vector<int32_t> kept;    ///< vertices of the whole mesh, ascending
  std::vector<Triangle> faces;  ///< of numbers in `kept`
};

/// About evenly spread vertices (evenly_spread(), nn/geometry/embedded_mesh.h), joined where the
/// regions of vertices that are nearer to one of them than to the others, along edges, meet in a
/// face (the dual of the Voronoi cells). 0, or not fewer than there are: the whole mesh.
ThinMesh thin_mesh(const Mesh& mesh, size_t vertices);
/// The body of these vertices. Needs a body without blend shapes.
Body thin_body(const Body& body, const ThinMesh& thin);

}  // namespace restage
