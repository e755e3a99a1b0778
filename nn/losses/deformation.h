// The losses of deformation (spec 5.2, 5.3).
#pragma once

#include "nn/losses/measure.h"

namespace restage {

/// Cross-entropy of weights [n, v, 22] against the data's, summed over points and pairs.
Var skin_cross_entropy(const Var& weights, const Tensor& truth);
/// Squared distances (v2, eq. 4) or distances (v1), summed over all points and pairs.
Var distance_sum(const Var& posed, const Var& truth, Measure measure = Measure::mse);

}  // namespace restage
