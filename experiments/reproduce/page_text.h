// Pieces of the pages of a reproduction.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "experiments/reproduce/page.h"

namespace restage::reproduce {

using Rows = std::vector<std::vector<std::string>>;

std::string number(const std::optional<double>& value);
/// "mean ± deviation [low, high]"; `sign`: a plus where it is above 0.
std::string with_interval(const tables::Estimate& e, bool sign = false);
std::string table_text(Rows rows);
std::string linked(const std::string& text, const std::string& to);
/// To the file with an experiment's table, seen from the page.
std::string link_to_table(const Found& f, const std::string& tables);

/// A claim with its comparisons, in the table's file.
std::string claim_text(const Claim& claim, const Judgement& judgement, const std::string& budget);
/// Every claim: what is compared, what the paper prints, what holds here, and why.
std::string claims_text(const std::vector<Found>& all, const std::string& tables,
                        const std::string& budget);

}  // namespace restage::reproduce
