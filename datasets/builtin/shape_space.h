// What makes built-in bodies differ, as directions about their average.
#pragma once

#include "nn/geometry/shape_space.h"

namespace restage {

/// The average body on a finer mesh, some 10,000 vertices, and what makes built-in bodies differ:
/// height, sex, fat, muscle, lengths and widths of parts. A step of 1 is about what half of all
/// people differ by. Takes seconds.
ShapeSpace builtin_shape_space();

}  // namespace restage
