// The box around points.
#pragma once

#include "nn/geometry/body.h"

namespace restage {

using Box = Eigen::AlignedBox3f;

/// Empty if there are no points.
inline Box box_of(const Points& points) {
  Box out;
  for (const Point& p : points) out.extend(p);
  return out;
}

}  // namespace restage
