// Whether the trials of a row were trained until they stopped learning.
#pragma once

#include <string>
#include <vector>

#include "experiments/sweep/results.h"

namespace restage::reproduce {

/// Why the trials of a case are not known to be trained far enough; empty: they are, or nothing of
/// them was trained. Every stage that they trained is judged by its validation: far enough is
/// where the last quarter of the steps lowers the figure by less than 2 % (the best value so far,
/// averaged over the seeds). The figure is that of `metrics` which the stage measures, else the
/// stage's first.
std::string too_short(const tables::Results& results, const std::string& case_name,
                      const std::vector<std::string>& metrics);

}  // namespace restage::reproduce
