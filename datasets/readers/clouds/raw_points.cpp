// Points of a LiDAR as bare numbers.
#include <algorithm>
#include <cmath>

#include "datasets/readers/clouds/mesh_parsers.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/numbers.h"
#include "datasets/readers/text/text.h"

namespace restage {
namespace {

constexpr double kFarthest = 1000;     // metres that a LiDAR sees
constexpr double kMostBeside = 65535;  // intensity or ring

double raw_number(std::string_view content, size_t index) {
  return number_at<float>(content.data() + index * sizeof(float));
}

bool are_raw_points(std::string_view content, size_t columns) {
  const size_t rows = content.size() / (columns * sizeof(float));
  double largest = 0;
  for (size_t i = 0; i < rows; ++i)
    for (size_t k = 0; k < columns; ++k) {
      const double value = raw_number(content, i * columns + k);
      if (k < 3 ? !(std::abs(value) <= kFarthest) : !(value >= 0 && value <= kMostBeside))
        return false;
      if (k < 3) largest = std::max(largest, std::abs(value));
      // Whole numbers, read as float32, are tiny.
      if (value != 0 && std::abs(value) < 1e-30) return false;
    }
  return rows > 0 && largest > 1e-3;
}

}  // namespace

size_t raw_columns(std::string_view head, uint64_t bytes) {
  for (const size_t columns : {4, 5})
    if (bytes % (columns * sizeof(float)) == 0 && are_raw_points(head, columns)) return columns;
  return 0;
}

Mesh parse_raw(std::string_view content, const std::string& path, const Vec3& origin,
               NonFinite how) {
  Mesh out;
  if (content.empty()) return out;
  const size_t columns = raw_columns(content, content.size());
  if (columns == 0)
    throw InputError(
        path,
        "is neither PLY, OBJ, glTF nor a cloud (PCD, XYZ), nor of the kind that LiDARs write "
        "(float32 [N, 4], x y z intensity)",
        "read it in Python with numpy.fromfile, and save the points, [N, 3], with "
        "numpy.save as NPY");
  const size_t rows = content.size() / (columns * sizeof(float));
  out.vertices.resize(rows);
  for (size_t i = 0; i < rows; ++i)
    for (int axis = 0; axis < 3; ++axis)
      out.vertices[i][axis] = text::coordinate(
          raw_number(content, i * columns + static_cast<size_t>(axis)) - origin[axis],
          [&] { return path; }, how);
  return out;
}

}  // namespace restage
