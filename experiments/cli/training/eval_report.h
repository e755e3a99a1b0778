// Tables of metrics as JSON (the contract of `restage eval --json`) and as Markdown.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "experiments/cli/output.h"
#include "nn/metrics/metrics.h"

namespace restage::cli {

struct EvalReport {
  std::span<const metrics::Metric> metrics = metrics::table();
  metrics::Evaluation model;
  std::vector<int64_t> frames;  ///< of every sequence of `model`
  /// Name ("rest_pose", "source_unchanged", "closed_form") and values; may be empty.
  std::vector<std::pair<std::string, metrics::Evaluation>> references;
};

/// {"mean": {...}, "sequences": [{"frames": n, ...}], "references": {name: {...}}}; a value that
/// cannot be computed is null.
Json to_json(const EvalReport& report);
/// One row for the prediction and one for each reference, one column for each metric.
std::string to_markdown(const EvalReport& report, const std::string& name = "prediction");

}  // namespace restage::cli
