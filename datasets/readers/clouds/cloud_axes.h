// Which axes of an array of numbers are frames, points and coordinates.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace restage {

/// Coordinate c of point i of frame f is element f * frame_step + i * point_step + (skipped + c) *
/// axis_step of the array in C order.
struct CloudAxes {
  int64_t sequences = 1;  ///< of equally many frames each, one behind the other
  int64_t frames = 1, points = 0;
  int64_t frame_step = 0, point_step = 0, axis_step = 0;
  int64_t columns = 3;    ///< numbers of a point, of which three count
  int64_t skipped = 0;    ///< columns before x
  bool sequence = false;  ///< has an axis of frames
  std::string remark;     ///< what was chosen, where it is not plain; else empty
  int64_t at(int64_t frame, int64_t point, int64_t axis) const {
    return frame * frame_step + point * point_step + (skipped + axis) * axis_step;
  }
  /// Whether each frame lies in one piece, one after the other.
  bool in_order() const { return !sequence || frame_step >= points * 3; }
};

/// Taken are [N, 3] and [F, N, 3]; more columns than three (colours, normals, up to 12 in all), of
/// which the first three count; axes in another order ([3, N], [6, N], [V, 3, F], [F, 3, V], [3, V,
/// F], [F, 6, V]): of two lengths the larger is that of the points, unless `vertices` says how many
/// there are; pictures of a depth camera of a known size, [H, W, 3], [3, H, W], [F, H, W, 3] or [F,
/// 3, H, W]; other [B, T, N, 3], which are B sequences of T frames; and, where `vertices` says it,
/// flat rows [F, 3 V] and [3 V, F]. Nothing for other shapes.
std::optional<CloudAxes> cloud_axes(const std::vector<int64_t>& shape, int64_t vertices = 0);

/// What to do with an array whose rows may be x y z of one point after the other ([F, 3 V], [3 N]):
/// how to reshape it. Nothing for other shapes.
std::optional<std::string> flat_mend(const std::vector<int64_t>& shape);

/// The numbers of steps [first, first + count) of an array's slowest axis, in C order.
using ReadSteps = std::function<std::vector<double>(int64_t first, int64_t count)>;

/// What only the numbers of an array tell, with a remark in the result's:
/// - of more than three columns the first counts the points (0, 1, 2 ...) or gives times at equal
///   steps: x, y and z are the three behind it;
/// - [B, T, N, 3] are pictures of a depth camera, [frames, height, width, 3], if the points of a
/// row
///   lie side by side and each row is far thinner than the whole;
/// - an array [V, F, 3] has its points first: what would be a frame is the path of one point.
/// `axes` are those of cloud_axes(), `vertices` as there.
CloudAxes axes_by_numbers(CloudAxes axes, const std::vector<int64_t>& shape, const ReadSteps& read,
                          int64_t vertices = 0);

/// Whether an array [4 to 12, 3 V] that cloud_axes() takes for rows of x, y, z and more holds a
/// frame in each row: the first rows are nearly the same.
bool rows_are_frames(const CloudAxes& axes, const std::vector<int64_t>& shape,
                     const ReadSteps& read);

}  // namespace restage
