// Clouds with the colours of their points.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

struct ColouredPoints {
  Points points;                              ///< as the file has them
  std::vector<std::array<float, 3>> colours;  ///< of each, sRGB, 0 to 1
};

/// The vertices of a PLY or OBJ file that has colours of vertices (of OBJ "v x y z r g b"); points
/// that are not finite are left out. Nothing for other files. InputError as read_mesh().
std::optional<ColouredPoints> read_coloured_points(const std::string& path);

}  // namespace restage
