// Normals of surfaces.
#pragma once

#include "nn/geometry/body.h"

namespace restage {

/// Of each vertex the mean of the normals of its faces, weighted by their areas, of length 1, added
/// up in V's precision (Point or Vec3). A vertex whose faces have no area, or that has none, gets
/// `none`. If `group` is not empty, vertex v counts as vertex group[v], and gets its normal.
template <class V>
std::vector<V> vertex_normals(const Points& vertices, const std::vector<Triangle>& faces,
                              const V& none, const std::vector<int32_t>& group = {}) {
  std::vector<V> out(vertices.size(), V::Zero());
  for (const Triangle& f : faces) {
    const auto at = [&](size_t k) -> V {
      return vertices[f[k]].template cast<typename V::Scalar>();
    };
    const V n = (at(1) - at(0)).cross(at(2) - at(0));
    for (const int32_t v : f) out[group.empty() ? v : group[v]] += n;
  }
  for (V& n : out) n = n.squaredNorm() > 0 ? V(n.normalized()) : none;
  for (size_t v = 0; v < group.size(); ++v) out[v] = out[group[v]];
  return out;
}

}  // namespace restage
