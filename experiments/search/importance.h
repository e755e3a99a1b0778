// Which key mattered: the share of the variance of results that each key explains by itself. The
// main effects of a functional ANOVA (Hutter, Hoos and Leyton-Brown, ICML 2014): a forest of
// regression trees is fitted to the trials, and in each tree the mean over all other keys is taken
// exactly. What keys do only together is in no share.
#pragma once

#include <cstdint>
#include <vector>

namespace restage::search {

/// What each trial had of one key, as numbers from 0 to `levels` - 1. Values that lie side by side
/// have numbers side by side; all numbers count the same.
struct Factor {
  int levels = 1;
  std::vector<int> of_trial;
};

/// Fewer trials say nothing.
inline constexpr int kLeastTrialsForImportance = 8;

/// The levels of numbers, by size.
Factor factor_of_numbers(const std::vector<double>& values);
/// The levels of names, by the mean of `results`, so that names with like results lie side by side.
Factor factor_of_names(const std::vector<int>& names, const std::vector<double>& results);

/// A share from 0 to 1 for each factor; all 0 if results do not differ. The same `seed`, the same
/// shares.
std::vector<double> importance(const std::vector<Factor>& factors,
                               const std::vector<double>& results, uint64_t seed = 0);

}  // namespace restage::search
