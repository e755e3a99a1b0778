// Soft shadows on the ground: what stands over it, laid down along the light on a map from above.
#pragma once

#include <vector>

#include "nn/geometry/body.h"

namespace restage {

/// Direction towards the main light: over the camera's left shoulder. `axes`: right, up, to the
/// eye.
Point key_light(const Eigen::Matrix3f& axes);

/// Darkness 0..1 on a square around `centre`; sharp and dark under feet, soft elsewhere.
std::vector<float> shadow_map(const Point& centre, float floor, const Point& light,
                              const Points& casts, const std::vector<Triangle>& faces);
/// Value of the map at a point of the ground, 0 outside.
float shadow_at(const std::vector<float>& map, const Point& centre, const Point& at);

}  // namespace restage
