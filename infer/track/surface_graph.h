// A coarse graph over a body's surface, by whose nodes the surface is deformed: Sumner, Schmid and
// Pauly, "Embedded deformation for shape manipulation" (SIGGRAPH 2007).
#pragma once

#include <array>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

struct SurfaceGraph {
  static constexpr size_t kLinks = 4;
  struct Link {
    std::array<int32_t, kLinks> node;
    std::array<double, kLinks> weight;  ///< the sum is 1
  };
  std::vector<int32_t> nodes;                 ///< the vertices that they are
  std::vector<Link> links;                    ///< of every vertex
  std::vector<std::array<int32_t, 2>> edges;  ///< between nodes; the lower number first
  std::vector<double> hold;  ///< of every node: how much more it keeps the body's shape; 1 or more
  double area = 0;           ///< of the surface at rest, square metres
};

/// `nodes` evenly over the surface (fewer if it has fewer vertices). Near is what is near at rest
/// and moved by the same joints: so a node of one thigh never moves the other. Hands and head hold
/// their shape more. InputError naming `where`: the body has no faces, or no area.
SurfaceGraph make_surface_graph(const Body& body, size_t nodes, const std::string& where);

}  // namespace restage
