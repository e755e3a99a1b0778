// Floors and walls in a scan.
#pragma once

#include <vector>

#include "nn/geometry/body.h"

namespace restage {

struct FlatPlane {
  Vec3 normal = Vec3::Zero();  ///< towards the person
  double offset = 0;           ///< normal . x of its points
};

struct Planes {
  std::vector<bool> on;           ///< one for each point
  size_t points = 0;              ///< how many are
  std::vector<FlatPlane> planes;  ///< the one with most points first
  bool any() const { return points > 0; }
};

/// Points on planes that reach far beyond everything else and have it all on one side; up to three.
/// Works in any unit; the same for the same points. What is flat altogether has no such plane.
Planes find_planes(const Points& points);

}  // namespace restage
