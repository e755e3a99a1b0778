#include "experiments/cli/training/eval_report.h"

#include <algorithm>
#include <cstdio>

namespace restage::cli {
namespace {

Json as_json(std::span<const metrics::Metric> names, const metrics::Values& values) {
  Json object = Json::object();
  for (size_t m = 0; m < names.size(); ++m)
    object[names[m].name] = values[m] ? Json(*values[m]) : Json(nullptr);
  return object;
}

std::string as_text(const metrics::Value& value) {
  if (!value) return "-";
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", *value);
  return text;
}

std::vector<std::string> as_row(const std::string& name, const metrics::Values& values) {
  std::vector<std::string> row{name};
  for (const metrics::Value& value : values) row.push_back(as_text(value));
  return row;
}

}  // namespace

Json to_json(const EvalReport& report) {
  Json document;
  document["mean"] = as_json(report.metrics, report.model.mean);
  document["sequences"] = Json::array();
  for (size_t s = 0; s < report.model.sequences.size(); ++s) {
    Json sequence;
    sequence["frames"] = report.frames[s];
    sequence.update(as_json(report.metrics, report.model.sequences[s]));
    document["sequences"].push_back(std::move(sequence));
  }
  for (const auto& [name, evaluation] : report.references)
    document["references"][name] = as_json(report.metrics, evaluation.mean);
  return document;
}

std::string to_markdown(const EvalReport& report, const std::string& name) {
  std::vector<std::vector<std::string>> rows{{""}};
  for (const metrics::Metric& metric : report.metrics)
    rows[0].push_back(std::string(metric.title) + " [" + metric.unit + "]");
  rows.push_back(as_row(name, report.model.mean));
  for (const auto& [key, evaluation] : report.references) {
    std::string words = key;
    std::replace(words.begin(), words.end(), '_', ' ');
    rows.push_back(as_row(words, evaluation.mean));
  }
  return markdown_table(rows);
}

}  // namespace restage::cli
