// A mesh that follows some of its vertices: embedded deformation (Sumner, Schmid and Pauly,
// "Embedded deformation for shape manipulation", SIGGRAPH 2007), each vertex by its nearest nodes.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

/// `count` of the points, about evenly spread (farthest point sampling from point 0), ascending.
/// Fewer where the others coincide with them.
std::vector<int32_t> evenly_spread(const Points& points, size_t count);

class EmbeddedMesh {
 public:
  static constexpr size_t kFewest = 5;  ///< nodes that other vertices can follow
  /// `whole`: a body at rest, metres. `nodes`: numbers of the vertices that are followed, each
  /// once, in any order. ShapeError: a node that is no vertex, fewer than kFewest unless they are
  /// all.
  EmbeddedMesh(const Points& whole, std::vector<int32_t> nodes);

  const std::vector<int32_t>& nodes() const { return nodes_; }
  /// All vertices, where the nodes have moved to `moved`, which are in the nodes' order. A node is
  /// exactly there. What lies around a node turns as the nodes near it have turned (Kabsch 1976).
  Points operator()(const Points& moved) const;

 private:
  static constexpr size_t kNear = 8;    ///< nodes that say how a node turns
  static constexpr size_t kFollow = 4;  ///< nodes that move a vertex
  struct Follower {
    std::array<int32_t, kFollow> node;
    std::array<float, kFollow> weight;  ///< sums to one
  };

  std::vector<int32_t> nodes_;
  Points rest_;                                   ///< of all vertices
  std::vector<std::array<int32_t, kNear>> near_;  ///< of each node; filled up with the node itself
  std::vector<Follower> followers_;               ///< of each vertex
};

}  // namespace restage
