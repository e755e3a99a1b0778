// How far two things are apart.
#pragma once

#include "autograd/tape/tape.h"

namespace restage {

/// Squares (most of the papers' losses), or distances, which weigh an error of 5 cm ten times as
/// much as one of 5 mm and not a hundred times (docs/method.md, "Past SMRM").
enum class Measure { mse, distance };

/// Of differences x [n, ...], whose last axis holds `width` numbers that belong together, or
/// several such groups: their squares [n, ...], or the length of each group [n, groups].
Var errors(const Var& x, Measure measure, int64_t width = 3);

/// Mean distance per point, metres (a number to report, not to differentiate).
double mean_distance(const Tensor& a, const Tensor& b);

}  // namespace restage
