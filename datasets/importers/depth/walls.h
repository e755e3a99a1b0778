// Floors, walls and ceilings that a depth camera sees.
#pragma once

#include <vector>

#include "datasets/doctor/planes.h"

namespace restage {

/// A plane of a square metre or more, wider than anybody. Unlike planes.h, which knows neither unit
/// nor camera: in metres, the camera at the origin, whose errors grow with the square of the
/// distance.
struct Wall {
  FlatPlane plane;       ///< its normal points to the camera
  double noise = 1;      ///< of its points, times what is usual
  bool is_last = false;  ///< hardly anything is seen behind it
  size_t points = 0;     ///< of those that were looked at
  double above(const Point& p) const { return plane.normal.dot(p.cast<double>()) - plane.offset; }
  /// Whether the point is on it, or behind the last there is.
  bool has(const Point& p) const;
};

/// At most six, that with most points first; the same for the same points.
std::vector<Wall> find_walls(const Points& points);

}  // namespace restage
