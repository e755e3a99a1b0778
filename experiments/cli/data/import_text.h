// What importers found in files, as text and JSON; for `restage data import` and `inspect`.
#pragma once

#include <string>
#include <vector>

#include "datasets/importers/report.h"
#include "experiments/cli/output.h"

namespace restage::cli {

/// {"file": ..., "facts": {...}, "remarks": [...]}, one for each.
Json reports_json(const std::vector<ImportReport>& reports);
/// Of one file, or if `verbose`, all facts; else a line for each of the first 40.
std::string reports_text(const std::vector<ImportReport>& reports, bool verbose);

}  // namespace restage::cli
