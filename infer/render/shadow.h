// Soft shadows on the ground: everything over the ground is projected along the light onto a map of
// the ground, seen from above.
#pragma once

#include <vector>

#include "nn/geometry/body.h"

namespace restage {

/// The unit vector towards the main light, which stands over the camera's left shoulder. Rows of
/// `axes`: the camera's right, its up, and the direction from the scene to the camera.
Point key_light(const Eigen::Matrix3f& axes);

/// A map of the shadow on a square of the ground around `centre`, of a surface or cloud `casts`,
/// `faces`: darkness 0 to 1. The shadow is sharp and dark under feet and soft elsewhere.
std::vector<float> shadow_map(const Point& centre, float floor, const Point& light,
                              const Points& casts, const std::vector<Triangle>& faces);
/// The darkness that `map` has at the point `at` of the ground; 0 outside the map.
float shadow_at(const std::vector<float>& map, const Point& centre, const Point& at);

}  // namespace restage
