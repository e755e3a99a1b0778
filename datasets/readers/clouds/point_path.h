// Whether points are the path of one point, such as the places of somebody's root, and no cloud.
#pragma once

#include "nn/geometry/body.h"

namespace restage {

/// Whether the points, in their order, are places of one moving point: most are nearest to the one
/// before or after, and the steps from one to the next are short and change little. Clouds and
/// surfaces are none, also in the order of a depth camera's rows, nor are the rings that a lidar of
/// few beams sees around a body. False for fewer than 8 places. `longest_step`: on average, times
/// the diagonal of the places. Nobody crosses the place where he moves in 25 frames, but a person's
/// points may be listed along a line (a helix of 80 points: 0.05).
bool is_path(const Points& points, double longest_step = 0.04);

}  // namespace restage
