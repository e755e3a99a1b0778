// Predictions made from scans in a frame of their own, put where their ground truth is.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "nn/geometry/skeleton.h"

namespace restage {

/// p' = scale x rotation x p + shift.
struct WorldMap {
  Mat3 rotation = Mat3::Identity();
  Vec3 shift = Vec3::Zero();
  double scale = 1;
  /// To [x, y, z] after [x, y, z]; without `scale` if `rigid`, the shift `stretched`.
  void carry(std::span<double> points, bool rigid, double stretched = 1) const;
  /// Turns world rotations, w x y z after w x y z.
  void turn(std::span<double> quaternions) const;
  double tilt() const;  ///< by how much up is off, degrees
};

/// /source_to_world of a truth file (datasets/README.md); nothing if it has none.
std::optional<WorldMap> source_to_world(const std::string& truth);
/// From the frame into which `restage doctor --fix` brought scans to the world: the doctor's
/// transform (the attribute of the file it wrote) undone, then `to_world`. InputError: no such
/// attribute.
WorldMap mended_to_world(const std::string& mended, const WorldMap& to_world);

}  // namespace restage
