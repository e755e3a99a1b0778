// A sweep's table written down: Markdown for terminals and pages, CSV with all digits, LaTeX
// (booktabs), a plot as SVG, JSON as the contract says (docs/experiments.md).
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "experiments/sweep/table.h"

namespace restage::tables {

/// A cell that does not end early: bars and line breaks of names.
std::string for_markdown(const std::string& text);
/// "3 done, 1 failed, 2 pending": what the rows stand on, and what they lack.
std::string counts_text(const Results& results);

/// A table for each set and, with a reference row, one of differences. Columns without any value
/// are left out. `mean ± deviation [low, high]`.
std::string to_markdown(const Table& table, const Results& results);
/// One line for each row, set and metric; numbers read back to the same bits.
std::string to_csv(const Table& table);
/// A LaTeX table for each set; needs the package booktabs.
std::string to_tex(const Table& table, const Results& results);
/// Means as dots with their intervals, a panel for each set and metric; no script, no fonts.
std::string to_svg(const Table& table);
nlohmann::ordered_json to_json(const Table& table, const Results& results);

/// By the ending of `path`: md, csv, tex or svg. InputError for any other.
std::string to_format(const Table& table, const Results& results, const std::string& path);

}  // namespace restage::tables
