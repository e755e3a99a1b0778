// NaN and infinite coordinates: readers refuse them; the doctor leaves such points out and says so.
#pragma once

#include "nn/geometry/body.h"

namespace restage {

enum class NonFinite {
  refuse,  ///< InputError
  mark,    ///< NaN, for leave_out_non_finite()
};

/// Takes out the points that are not to be kept, and the triangles at them; the order of the rest
/// stays. How many.
size_t keep_points(const std::vector<bool>& keep, Points& points, std::vector<Triangle>& faces);
/// The same of points with a NaN.
size_t leave_out_non_finite(Points& points, std::vector<Triangle>& faces);

}  // namespace restage
