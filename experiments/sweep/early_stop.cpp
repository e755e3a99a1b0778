#include "experiments/sweep/early_stop.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

namespace restage::sweep {
namespace {

constexpr size_t kLeastOthers = 3;
constexpr double kReduction = 3;  ///< of ASHA: a third goes on

std::string short_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

/// The value with which a training came to `step`; nothing if it has not.
std::optional<double> at(const Curve& curve, double step) {
  for (const CurvePoint& p : curve)
    if (static_cast<double>(p.done) >= step) return p.value;
  return std::nullopt;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
}

std::string by_median(const Curve& mine, const std::vector<Curve>& others) {
  const int64_t done = mine.back().done;
  std::vector<double> means;
  for (const Curve& other : others) {
    if (other.empty() || other.back().done < done) continue;
    double sum = 0, count = 0;
    for (const CurvePoint& p : other)
      if (p.done <= done) {
        sum += p.value;
        ++count;
      }
    if (count > 0) means.push_back(sum / count);
  }
  if (means.size() < kLeastOthers) return "";
  const double best = std::min_element(mine.begin(), mine.end(), [](const auto& a, const auto& b) {
                        return a.value < b.value;
                      })->value;
  if (best <= median(means)) return "";
  return short_text(best) + " at best, the median of " + std::to_string(means.size()) +
         " others is " + short_text(median(means));
}

std::string by_asha(const EarlyStop& rule, const Curve& mine, int64_t steps,
                    const std::vector<Curve>& others) {
  const auto done = static_cast<double>(mine.back().done);
  const double before = mine.size() < 2 ? 0 : static_cast<double>(mine[mine.size() - 2].done);
  double rung = std::max(1.0, rule.after * static_cast<double>(steps));
  while (rung * kReduction <= done) rung *= kReduction;
  if (before >= rung) return "";  // judged there already
  const double own = mine.back().value;
  size_t all = 1, better = 0;
  for (const Curve& other : others)
    if (const auto value = at(other, rung)) {
      ++all;
      better += *value < own;
    }
  const auto room = static_cast<size_t>(static_cast<double>(all) / kReduction);
  if (all <= kLeastOthers || better < std::max<size_t>(1, room)) return "";
  return short_text(own) + ", which " + std::to_string(better) + " of " + std::to_string(all - 1) +
         " others beat at that step";
}

}  // namespace

Curve read_curve(const std::string& metrics_jsonl, const std::string& figure) {
  Curve out;
  std::istringstream lines(metrics_jsonl);
  for (std::string line; std::getline(lines, line);) {
    if (line.find("\"" + figure + "\"") == std::string::npos) continue;
    const auto json = nlohmann::json::parse(line, nullptr, false);
    if (!json.is_object()) continue;
    const auto step = json.find("step"), value = json.find(figure);
    if (step == json.end() || value == json.end() || !step->is_number_integer()) continue;
    // A training that has come to no number is as bad as can be.
    const double number = value->is_number() ? value->get<double>() : INFINITY;
    out.push_back({step->get<int64_t>(), number});
  }
  return out;
}

std::string reason_to_stop(const EarlyStop& rule, const Curve& mine, int64_t steps,
                           const std::vector<Curve>& others) {
  if (mine.empty() || mine.back().done >= steps ||
      static_cast<double>(mine.back().done) < rule.after * static_cast<double>(steps))
    return "";
  const std::string found =
      rule.rule == "asha" ? by_asha(rule, mine, steps, others) : by_median(mine, others);
  if (found.empty()) return "";
  return "stopped early by " + rule.rule + " after " + std::to_string(mine.back().done) + " of " +
         std::to_string(steps) + " steps: " + rule.metric + " " + found;
}

EarlyStopper::EarlyStopper(EarlyStop rule, Store store, StageId own, std::vector<StageId> all)
    : rule_(std::move(rule)),
      store_(std::move(store)),
      own_(std::move(own)),
      all_(std::move(all)) {}

void EarlyStopper::on_validation(Stage& stage, int64_t /*done*/, const NamedValues&) {
  if (stage.name() != rule_.stage()) return;
  std::vector<Curve> others;
  for (const StageId& id : all_)
    if (id.id != own_.id) others.push_back(read_curve(store_.metrics(id), rule_.figure()));
  const std::string why = reason_to_stop(rule_, read_curve(store_.metrics(own_), rule_.figure()),
                                         stage.steps(), others);
  if (!why.empty()) throw StoppedEarly(why);
}

}  // namespace restage::sweep
