// Floors and walls in a scan.
#pragma once

#include <vector>

#include "nn/geometry/body.h"

namespace restage {

struct Planes {
  std::vector<bool> on;        ///< one for each point
  size_t points = 0;           ///< how many are
  Vec3 normal = Vec3::Zero();  ///< of the first plane found, towards the person
  bool any() const { return points > 0; }
};

/// Points on planes that reach far beyond everything else and have it all on one side; up to three.
/// Works in any unit; the same for the same points. What is flat altogether has no such plane.
Planes find_planes(const Points& points);

}  // namespace restage
