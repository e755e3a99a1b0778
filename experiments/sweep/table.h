// The table of a sweep: trials grouped into rows, a row's metrics with deviation and interval
// (experiments/sweep/statistics.h is the rule), differences to one row. table_formats.h writes it.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "experiments/sweep/results.h"
#include "experiments/sweep/statistics.h"
#include "nn/metrics/metrics.h"

namespace restage::tables {

struct TableOptions {
  std::vector<std::string> rows = {};  ///< keys to group by, also "case"; none: case and overrides
  std::vector<std::string> columns = {};  ///< METRIC; none: all
  std::string against = {};  ///< a row's label or the unambiguous beginning of one; or none
};

struct Cell {
  Estimate value;
  std::optional<Estimate> difference;  ///< to the reference row, of the pairs; none for that row
};

struct Row {
  std::string label;      ///< what tells it from the others: its case and keys; unique
  std::string case_name;  ///< empty: none, or several
  std::map<std::string, nlohmann::json> overrides;  ///< those that all its trials share
  std::vector<uint64_t> seeds;                      ///< of the trials that are done, sorted
  bool reference = false;                ///< what needs no learning; each cell has an n of its own
  int n = 0;                             ///< trials that are done
  std::vector<std::vector<Cell>> cells;  ///< [set][column]
};

struct Table {
  std::vector<std::string> sets;
  std::vector<const metrics::Metric*> columns;
  std::vector<Row> rows;             ///< of trials, then of references
  size_t references = 0;             ///< how many of the rows are of what needs no learning
  std::optional<size_t> against;     ///< index of the row that differences are to
  std::vector<std::string> notices;  ///< what a reader of the figures must know, a line each
};

/// The means of what needs no learning by case of the trials that it was measured beside; nothing
/// if trials of a seed agree. They do not where cases differ in what it sees (clouds, extractor):
/// then its row, an average, says little. `label`: that of its row.
std::map<std::string, MetricValues> reference_by_case(const Results& results,
                                                      const std::string& set,
                                                      const std::string& label);

/// InputError: unknown key, metric or row.
Table make_table(const Results& results, const TableOptions& options);

}  // namespace restage::tables
