// One cloud of a take, made ready for surfaces to be fitted to it.
#pragma once

#include <string>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

/// Points about kScanCell apart, each with the direction of the surface about it.
struct Scan {
  std::vector<Vec3> points;   ///< metres
  std::vector<Vec3> normals;  ///< of length 1; which of both ways they point says nothing
};

inline constexpr double kScanCell = 0.015;  ///< metres

/// Of all points in a cube of kScanCell the mean; normals are those of planes through the nearest
/// points. UnusableCloud naming `source`: see thinned() (infer/registration/registration.h).
Scan make_scan(const Points& cloud, const std::string& source);

/// A point of a scan, and the vertex of a surface that it is taken to show.
struct SurfaceMatch {
  size_t vertex;
  Vec3 point;
  double weight;  ///< 1 where they are in the same place, falling to 0 with their distance
};

/// For every point of the scan the nearest vertex. Left out are points farther than three `width`s
/// (metres), and those whose surface lies more than 60 degrees otherwise than the vertex'. Weights
/// are Geman and McClure's. `normals`: of the vertices.
std::vector<SurfaceMatch> match_surface(const Scan& scan, const std::vector<Vec3>& vertices,
                                        const std::vector<Vec3>& normals, double width);

}  // namespace restage
