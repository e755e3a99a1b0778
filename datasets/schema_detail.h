// Shared by schema*.cpp and the readers only.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "autograd/base/error.h"
#include "datasets/schema.h"

namespace restage {

/// InputError with row and value if one is NaN or infinite.
template <class T>
void check_finite(const std::string& where, const std::vector<T>& values, int64_t row_size,
                  int64_t first_row = 0) {
  for (size_t i = 0; i < values.size(); ++i)
    if (!std::isfinite(values[i]))
      throw InputError(where,
                       "row " + std::to_string(first_row + static_cast<int64_t>(i) / row_size) +
                           " holds " + (std::isnan(values[i]) ? "NaN" : "infinity"),
                       "store finite numbers");
}

template <class T>
std::vector<T> read_finite(const h5::File& file, const std::string& name, const h5::Shape& wanted) {
  const h5::Dataset set = file.dataset(name, wanted);
  std::vector<T> values = set.read<T>();
  check_finite(set.where(), values, std::max<int64_t>(set.row_size(), 1));
  return values;
}

/// Shows a data set's values to `look(values, first row, rows)` some rows at a time, in order.
template <class T, class Look>
void for_blocks(const h5::Dataset& set, Look&& look) {
  constexpr int64_t kBlock = int64_t{4} << 20;  // bytes
  const int64_t row = std::max<int64_t>(set.row_size(), 1) * static_cast<int64_t>(sizeof(T)),
                step = std::max<int64_t>(1, kBlock / row);
  std::vector<T> values;
  for (int64_t first = 0; first < set.rows(); first += step) {
    const int64_t rows = std::min(step, set.rows() - first);
    set.read_rows(first, rows, values);
    look(values, first, rows);
  }
}

/// check_finite() of a whole data set, in memory that does not grow with it.
template <class T>
void check_all_finite(const h5::Dataset& set) {
  for_blocks<T>(set, [&](const std::vector<T>& values, int64_t first, int64_t) {
    check_finite(set.where(), values, std::max<int64_t>(set.row_size(), 1), first);
  });
}

/// Where sequences begin, and the end; [0, frames] where the file does not say.
std::vector<int64_t> sequence_offsets(const h5::File& file, int64_t frames);
void write_sequence_offset(h5::File& file, std::vector<int64_t> offset, int64_t frames);
/// What data sets of points and of joints hold.
std::span<const float> as_floats(const Points& points);
std::array<float, kJoints * 3> flat_joints(const Joints& joints);

/// Faces [T,3]; every index is checked against the number of vertices.
std::vector<Triangle> read_faces(const h5::File& file, const std::string& name, int64_t vertices);
void write_faces(h5::File& file, const std::string& name, const std::vector<Triangle>& faces);
Points read_points(const h5::File& file, const std::string& name);  ///< [N,3] float32, finite
void write_points(h5::File& file, const std::string& name, const Points& points);
/// The file's frame rate; the project's if it says none. InputError if it is not positive.
double read_fps(const h5::File& file);
/// kJointDefinition of an object ("/": the file); empty: it does not say. InputError: no name.
JointDefinition read_definition(const h5::File& file, const std::string& object);

/// Blend shapes of a file by name: large, and read once for all bodies that share them.
using SharedShapes = std::map<std::string, std::shared_ptr<const PoseBlendShapes>>;

/// One member of /bodies or /motions, checked.
Body read_body(const h5::File& file, const std::string& id, SharedShapes& shared);
Motion read_motion(const h5::File& file, const std::string& id);

/// Licences or provenances of files that become one: the parts of each ("a; b"), what several say
/// once.
std::string joined_texts(const std::vector<std::string>& texts);

}  // namespace restage
