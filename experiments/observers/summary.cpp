#include "experiments/observers/summary.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "autograd/base/atomic_file.h"

namespace restage {
namespace {

using SummaryJson = nlohmann::ordered_json;

std::string summary_path(const std::string& run) { return run + "/summary.json"; }

SummaryJson object_of(const NamedValues& values) {
  SummaryJson out = SummaryJson::object();
  for (const auto& [name, value] : values)
    out[name] = std::isfinite(value) ? SummaryJson(value) : nullptr;
  return out;
}

NamedValues values_of(const SummaryJson& object) {
  NamedValues out;
  for (const auto& [name, value] : object.items())
    out.emplace_back(name, value.is_number() ? value.get<double>() : std::nan(""));
  return out;
}

const char* name_of(RunEnd how) {
  return how == RunEnd::finished ? "finished" : how == RunEnd::stopped ? "stopped" : "failed";
}

}  // namespace

RunSummary::RunSummary(std::string run) : run_(std::move(run)) {
  if (!is_there(summary_path(run_))) return;
  const auto before = SummaryJson::parse(read_file(summary_path(run_)), nullptr, false);
  if (!before.is_object()) return;  // somebody else's; it is written anew
  try {
    for (const auto& s : before.at("stages"))
      stages_.push_back(
          {s.at("stage"), s.at("steps"), values_of(s.at("values")), values_of(s.at("figures"))});
    for (const auto& w : before.at("warnings"))
      warnings_.push_back({w.at("stage"), w.at("step"), {w.at("kind"), w.at("said")}});
  } catch (const SummaryJson::exception&) {
    stages_.clear(), warnings_.clear();
  }
}

RunSummary::StageEnd& RunSummary::of(const std::string& stage) {
  for (StageEnd& known : stages_)
    if (known.stage == stage) return known;
  stages_.push_back({stage, 0, {}, {}});
  return stages_.back();
}

void RunSummary::on_step(const Stage& stage, int64_t done, const NamedValues& values) {
  StageEnd& own = of(stage.name());
  own.steps = done;
  own.values = values;
}

void RunSummary::on_validation(Stage& stage, int64_t, const NamedValues& figures) {
  of(stage.name()).figures = figures;
}

void RunSummary::on_warning(const std::string& stage, int64_t done, const TrainWarning& warning) {
  std::erase_if(warnings_, [&](const Said& said) {
    return said.stage == stage && said.warning.kind == warning.kind;
  });
  warnings_.push_back({stage, done, warning});
}

void RunSummary::end(RunEnd how) {
  SummaryJson stages = SummaryJson::array(), warnings = SummaryJson::array();
  for (const StageEnd& s : stages_)
    stages.push_back({{"stage", s.stage},
                      {"steps", s.steps},
                      {"values", object_of(s.values)},
                      {"figures", object_of(s.figures)}});
  for (const Said& w : warnings_)
    warnings.push_back(
        {{"stage", w.stage}, {"step", w.step}, {"kind", w.warning.kind}, {"said", w.warning.said}});
  const SummaryJson out = {{"end", name_of(how)}, {"stages", stages}, {"warnings", warnings}};
  write_file_atomically(summary_path(run_),
                        out.dump(2, ' ', false, SummaryJson::error_handler_t::replace) + "\n");
}

}  // namespace restage
