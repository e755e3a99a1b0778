// How far points are from a surface.
#pragma once

#include <vector>

#include "nn/geometry/body.h"

namespace restage {

/// Of distances, metres.
struct MiddleAndMost {
  double median = 0, p95 = 0;
};
/// Zeros for no distances.
MiddleAndMost middle_and_most(std::vector<double> distances);

/// Which faces meet in each vertex of a mesh.
class SurfaceDistance {
 public:
  explicit SurfaceDistance(const Mesh& mesh);
  /// Of each point the distance from the faces about the nearest vertices of the deformed mesh,
  /// metres; `vertices` must be as many as the mesh's.
  std::vector<double> operator()(const std::vector<Vec3>& points,
                                 const std::vector<Vec3>& vertices) const;

 private:
  std::vector<Triangle> faces_;
  std::vector<std::vector<int32_t>> about_;
};

}  // namespace restage
