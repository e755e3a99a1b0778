// Search by tree-structured Parzen estimators: J. Bergstra et al., Algorithms for Hyper-Parameter
// Optimization, NIPS 2011. What was found so far is divided into good and bad points; a density is
// laid over each, and the next point is the one that is likeliest under the good ones and least
// likely under the bad. As in Optuna (Akiba et al., KDD 2019) with `multivariate` and
// `constant_liar`: a point's keys are drawn together, the best tenth counts as good, and a trial
// that still runs counts as bad, so that trials at once do not ask the same.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "experiments/search/space.h"

namespace restage::search {

/// A point that was asked for.
struct Told {
  Point point;
  /// Less is better. Infinite: the trial failed; nothing: it is not over.
  std::optional<double> value;
};

struct TpeOptions {
  uint64_t seed = 0;
  int startup = 10;  ///< the first points are a Latin hypercube of so many
};

/// The point that is asked for after `told` (in the order of asking). A pure function of its
/// arguments. Nothing: every point of the space has been asked for.
std::optional<Point> propose(const Space& space, const std::vector<Told>& told,
                             const TpeOptions& options);

}  // namespace restage::search
