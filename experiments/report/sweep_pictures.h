// Pictures of a sweep for its page, as SVG that needs no script: how every trial went, which key
// mattered, and what each value gave.
#pragma once

#include <string>
#include <vector>

#include "experiments/report/page.h"
#include "experiments/sweep/sweep_dir.h"

namespace restage::report {

/// Sections with pictures of what there is to be drawn; none without a figure that trials share.
std::vector<Section> sweep_pictures(const sweep::SweepDir& dir, const tables::Results& results);

}  // namespace restage::report
