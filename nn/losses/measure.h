// How errors are measured: as squares or as distances.
#pragma once

#include "autograd/tape/tape.h"

namespace restage {

/// Squares (most of the papers' losses), or distances, which weigh an error of 5 cm ten times as
/// much as one of 5 mm and not a hundred times (docs/method.md, "Past SMRM").
enum class Measure { mse, distance };

/// Errors of differences x [n, ...], whose last axis holds one or several groups of `width` numbers
/// that belong together. mse: the squares [n, ...]; distance: the length of each group [n, groups].
Var errors(const Var& x, Measure measure, int64_t width = 3);

/// Mean distance per point, metres (a number to report, not to differentiate).
double mean_distance(const Tensor& a, const Tensor& b);

}  // namespace restage
