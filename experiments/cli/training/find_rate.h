// What `restage train --find-rate` draws and says.
#pragma once

#include <string>
#include <vector>

#include "experiments/cli/output.h"
#include "train/rate_sweep.h"

namespace restage::cli {

/// {"stages": [{"stage", "suggested", "tenth_of_least", "steps"}, ...]}; null where a sweep says
/// nothing.
Json rates_json(const std::vector<RateSweep>& sweeps);
std::string rates_markdown(const std::vector<RateSweep>& sweeps);
/// Loss over rate, a panel a stage: each step, their mean, and a mark at the suggested rate.
std::string rates_svg(const std::vector<RateSweep>& sweeps);

}  // namespace restage::cli
