// Which axes of an array of numbers are frames, points and coordinates.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace restage {

/// Coordinate c of point i of frame f is element f * frame_step + i * point_step + c * axis_step of
/// the array in C order.
struct CloudAxes {
  int64_t frames = 1, points = 0;
  int64_t frame_step = 0, point_step = 0, axis_step = 0;
  bool sequence = false;  ///< has an axis of frames
  std::string remark;     ///< what was chosen, where it is not plain; else empty
  int64_t at(int64_t frame, int64_t point, int64_t axis) const {
    return frame * frame_step + point * point_step + axis * axis_step;
  }
  /// Whether each frame lies in one piece, one after the other.
  bool in_order() const { return !sequence || frame_step >= points * 3; }
};

/// Taken are [N, 3] and [F, N, 3]; more columns than three (colours, normals, up to 12 in all), of
/// which the first three count; axes in another order ([3, N], [V, 3, F], [F, 3, V], [3, V, F]): of
/// two lengths the larger is that of the points, unless `vertices` says how many there are;
/// pictures of a depth camera, [H, W, 3] of a known size or [F, H, W, 3]. Nothing for other shapes.
std::optional<CloudAxes> cloud_axes(const std::vector<int64_t>& shape, int64_t vertices = 0);

}  // namespace restage
