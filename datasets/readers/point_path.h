// Whether points are the path of one point, such as the places of somebody's root, and no cloud.
#pragma once

#include "nn/geometry/body.h"

namespace restage {

/// Whether the points, in their order, are places of one moving point: most are nearest to the one
/// before or after, and the steps from one to the next change little. Clouds and surfaces are none,
/// also in the order of a depth camera's rows. False for fewer than 8 places.
bool is_path(const Points& points);

}  // namespace restage
