// People whose vertices correspond, as an average and directions in which they differ from it.
#pragma once

#include <vector>

#include "nn/geometry/body.h"

namespace restage {

struct ShapeSpace {
  Body average;                  ///< in T-pose, metres, the lowest vertex at y = 0
  std::vector<Points> vertices;  ///< of each direction, how a step of 1 moves the vertices, metres
  std::vector<Joints> joints;    ///< the same of the joints
  size_t size() const { return vertices.size(); }
  /// The person so many steps along each direction. The skin weights are the average's.
  Body at(const std::vector<double>& steps) const {
    Body out = average;
    for (size_t k = 0; k < size(); ++k) {
      const auto step = static_cast<float>(steps[k]);
      for (size_t v = 0; v < vertices[k].size(); ++v) out.rest.vertices[v] += step * vertices[k][v];
      for (size_t j = 0; j < kJoints; ++j) out.joints[j] += steps[k] * joints[k][j];
    }
    return out;
  }
};

}  // namespace restage
