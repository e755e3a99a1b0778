// A row of the open benchmark's table as a file: who was measured, on which build of the benchmark,
// by which version of the program, and what every seed came to on every sequence. A leaderboard is
// made of such files alone. Rows come from anybody, so nothing in them is believed.
//
//   {"format": "restage-benchmark-row-1", "method": "...", "told": "clouds", "date": "2026-01-31",
//    "note": "...", "restage": "1.0", "benchmark": {"protocol": "...", "sha256": "..."},
//    "refused": ["scans/..."], "trials": [{"seed": 1, "metrics": {SET: ...}}, ...]}
//
// "metrics" is that of a trial's result (docs/experiments.md). What nobody recorded is null.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "experiments/sweep/results.h"

namespace restage::tables {

/// What is said of a row beside its figures. Empty text: not recorded.
struct RowFacts {
  std::string method, told, date, note;
  std::string restage;             ///< version of the program that measured
  std::string protocol, checksum;  ///< of the benchmark; SHA-256 of its manifest.json
  std::vector<std::string> refused;
};

struct BenchmarkRow : RowFacts {
  std::string path;
  Results results;  ///< a trial for each seed, the method as their case
};

/// `trials`: each seed with the section "metrics" of a trial's result, of which scores of sequences
/// and references are kept; references that a trial before had alike are not kept again.
nlohmann::ordered_json row_document(
    const RowFacts& facts, const std::vector<std::pair<uint64_t, nlohmann::ordered_json>>& trials);
/// InputError: damaged, or no such file.
BenchmarkRow parse_row(const nlohmann::json& document, const std::string& path);
BenchmarkRow read_row(const std::string& path);

/// What needs no learning is the same for all trials of the same sequences and frames: those that
/// lack it get it, and others the same bits, from the first trial that has it.
void share_references(Results* results);

/// The page of all rows in Markdown: a table for each figure (method by set, millimetres; mean,
/// deviation and 95 % interval), the differences to "source unchanged", and where the rows are
/// from. Rows with all sets come first, the smallest mean PA-MPJPE on top. InputError: two rows of
/// one method.
std::string leaderboard_markdown(const std::vector<BenchmarkRow>& rows);

}  // namespace restage::tables
