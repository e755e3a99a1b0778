#include "experiments/report/sweep_pictures.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "autograd/base/format.h"
#include "autograd/base/words.h"
#include "experiments/search/importance.h"
#include "experiments/sweep/objective.h"
#include "experiments/sweep/svg.h"
#include "experiments/sweep/table_formats.h"

namespace restage::report {
namespace {

using tables::Svg;

constexpr double kWide = 680, kHigh = 260, kPanelWide = 220, kPanelHigh = 150;
constexpr double kLeft = 64, kTopRoom = 26, kBelow = 30;
/// Values that lie so far apart, the most of them at the lower end, have a logarithmic axis.
constexpr double kManyTimes = 20, kLowEnd = 0.15;
constexpr size_t kMostPanels = 12;
constexpr const char* kPaleInk = "#b8bec8";
constexpr const char* kBestInk = "#0072b2";

/// A trial as pictures see it.
struct Drawn {
  const tables::TrialResult* trial;
  std::optional<double> value;  ///< finite
  sweep::Curve curve;
};

struct Sheet {
  std::string metric;
  std::vector<Drawn> trials;  ///< in the order of the plan
  std::optional<size_t> best;
};

Sheet sheet_of(const sweep::SweepDir& dir, const tables::Results& results) {
  Sheet out{sweep::main_metric(dir), {}, {}};
  if (out.metric.empty()) return out;
  for (const tables::TrialResult& trial : results.trials) {
    Drawn one{&trial, {}, {}};
    const auto result = sweep::read_result(dir, trial.id);
    const auto value = sweep::value_of(dir, trial, result, out.metric);
    if (value && std::isfinite(*value)) one.value = value;
    for (const sweep::CurvePoint& point : sweep::curve_of(dir, trial, result, out.metric))
      if (std::isfinite(point.value)) one.curve.push_back(point);
    if (one.value && (!out.best || *one.value < *out.trials[*out.best].value))
      out.best = out.trials.size();
    out.trials.push_back(std::move(one));
  }
  return out;
}

/// An axis that is logarithmic where values lie far apart.
class Scale {
 public:
  Scale(const std::vector<double>& values, double from, double to)
      : log_(is_log(values)), axis_(low(values), high(values), from, to) {}

  double at(double value) const { return axis_.at(log_ ? std::log10(value) : value); }
  /// Places with their labels.
  std::vector<std::pair<double, std::string>> marks() const {
    std::vector<std::pair<double, std::string>> out;
    for (const double mark : axis_.marks())
      out.emplace_back(axis_.at(mark), tables::short_number(log_ ? std::pow(10, mark) : mark));
    return out;
  }

 private:
  static bool is_log(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values.front() > 0 && values.back() > kManyTimes * values.front() &&
           values[values.size() / 2] < kLowEnd * values.back();
  }
  double low(const std::vector<double>& values) const {
    const double x = *std::min_element(values.begin(), values.end());
    return log_ ? std::log10(x) : x;
  }
  double high(const std::vector<double>& values) const {
    const double x = *std::max_element(values.begin(), values.end());
    return log_ ? std::log10(x) : x;
  }

  bool log_;
  tables::Axis axis_;
};

/// Lines and numbers of both axes; across, whole numbers only.
void draw_marks(const tables::Axis& across, const Scale& up, Svg* out) {
  Svg& svg = *out;
  for (const auto& [at, label] : up.marks()) {
    svg.line(kLeft, at, kWide - 20, at, "#e3e6ea");
    svg.text(kLeft - 6, at + 4, label, "end", 10, "#555");
  }
  for (const double mark : across.marks())
    if (mark == std::round(mark))
      svg.text(across.at(mark), kHigh - 12, tables::short_number(mark), "middle", 10, "#555");
}

/// Every trial's validations, the best trial's in colour.
std::string curves_svg(const Sheet& sheet) {
  std::vector<double> steps, values;
  for (const Drawn& one : sheet.trials)
    for (const sweep::CurvePoint& point : one.curve) {
      steps.push_back(static_cast<double>(point.done));
      values.push_back(point.value);
    }
  if (values.empty()) return "";
  const tables::Axis across(*std::min_element(steps.begin(), steps.end()),
                            *std::max_element(steps.begin(), steps.end()), kLeft, kWide - 20);
  const Scale up(values, kHigh - kBelow, kTopRoom);
  Svg svg;
  draw_marks(across, up, &svg);
  const auto draw = [&](const Drawn& one, const std::string& colour) {
    std::vector<std::pair<double, double>> line;
    for (const sweep::CurvePoint& point : one.curve)
      line.emplace_back(across.at(static_cast<double>(point.done)), up.at(point.value));
    if (line.empty()) return;
    svg.polyline(line, colour);
    svg.dot(line.back().first, line.back().second, 2.2, colour);
  };
  for (size_t t = 0; t < sheet.trials.size(); ++t)
    if (sheet.best != t) draw(sheet.trials[t], kPaleInk);
  if (sheet.best) draw(sheet.trials[*sheet.best], kBestInk);
  svg.text(kLeft, 16, sheet.metric + " by step", "start", 12);
  return svg.document(kWide, kHigh);
}

/// What each trial came to, in the order of the plan, and the best so far.
std::string history_svg(const Sheet& sheet) {
  std::vector<double> values, numbers;
  for (size_t t = 0; t < sheet.trials.size(); ++t)
    if (sheet.trials[t].value) {
      values.push_back(*sheet.trials[t].value);
      numbers.push_back(static_cast<double>(t + 1));
    }
  if (values.size() < 2) return "";
  const tables::Axis across(numbers.front(), numbers.back(), kLeft, kWide - 20);
  const Scale up(values, kHigh - kBelow, kTopRoom);
  Svg svg;
  draw_marks(across, up, &svg);
  std::vector<std::pair<double, double>> line;
  double best = values[0];
  for (size_t i = 0; i < values.size(); ++i) {
    if (!line.empty()) line.emplace_back(across.at(numbers[i]), up.at(best));
    best = std::min(best, values[i]);
    line.emplace_back(across.at(numbers[i]), up.at(best));
    svg.dot(across.at(numbers[i]), up.at(values[i]), 3, kPaleInk);
  }
  svg.polyline(line, kBestInk);
  svg.text(kLeft, 16, sheet.metric + " by number of the trial; the line: the best so far", "start",
           12);
  return svg.document(kWide, kHigh);
}

// ---- keys ----

/// A key and what each trial had of it.
struct Varied {
  std::string key;
  std::vector<nlohmann::json> values;  ///< null: the trial has none
  bool numbers = true;
};

/// Keys of which trials with a value had different ones.
std::vector<Varied> varied_keys(const std::vector<const Drawn*>& trials) {
  std::map<std::string, Varied> all;
  for (size_t t = 0; t < trials.size(); ++t) {
    const tables::TrialResult& trial = *trials[t]->trial;
    std::map<std::string, nlohmann::json> own(trial.overrides.begin(), trial.overrides.end());
    own["case"] = trial.case_name;
    own["seed"] = trial.seed;
    for (const auto& [key, value] : own) {
      Varied& varied = all.try_emplace(key, Varied{key, {}, true}).first->second;
      varied.values.resize(trials.size());
      varied.values[t] = value;
    }
  }
  std::vector<Varied> out;
  for (auto& [key, varied] : all) {
    for (const nlohmann::json& value : varied.values)
      varied.numbers = varied.numbers && value.is_number();
    if (std::any_of(varied.values.begin(), varied.values.end(),
                    [&first = varied.values[0]](const auto& value) { return value != first; }))
      out.push_back(std::move(varied));
  }
  return out;
}

search::Factor factor_of(const Varied& varied, const std::vector<double>& results) {
  if (varied.numbers) {
    std::vector<double> numbers;
    for (const nlohmann::json& value : varied.values) numbers.push_back(value.get<double>());
    return search::factor_of_numbers(numbers);
  }
  std::map<std::string, int> names;
  std::vector<int> of_trial;
  for (const nlohmann::json& value : varied.values)
    of_trial.push_back(
        names.try_emplace(value.dump(), static_cast<int>(names.size())).first->second);
  return search::factor_of_names(of_trial, results);
}

std::string importance_svg(const std::vector<std::pair<double, std::string>>& shares) {
  const double room = 260, step = 24;
  Svg svg;
  double y = 14;
  for (const auto& [share, key] : shares) {
    svg.text(room - 8, y + 11, key.size() > 42 ? "..." + key.substr(key.size() - 40) : key, "end",
             11);
    const double end = room + std::max(1.0, share * (kWide - room - 70));
    svg.line(room, y + 7, end, y + 7, kBestInk, 13);
    svg.text(end + 6, y + 11, format("%.0f %%", 100 * share), "start", 11, "#555");
    y += step;
  }
  return svg.document(kWide, y + 6);
}

/// A dot for each trial above its value of the key.
void draw_slice(const Varied& varied, const std::vector<const Drawn*>& trials, const Scale& up,
                double x, double y, Svg* svg) {
  std::vector<std::string> names;
  std::vector<double> places;
  for (const nlohmann::json& value : varied.values) {
    if (varied.numbers) {
      places.push_back(value.get<double>());
      continue;
    }
    const std::string name = value.is_null() ? "-" : tables::plain_text(value);
    const auto at = std::find(names.begin(), names.end(), name);
    places.push_back(static_cast<double>(at - names.begin()));
    if (at == names.end()) names.push_back(name);
  }
  const Scale across(places, x, x + kPanelWide - kLeft);
  const double bottom = y + kPanelHigh - kTopRoom - kBelow;
  for (const auto& [at, label] : up.marks()) {
    svg->line(x, y + at, x + kPanelWide - kLeft, y + at, "#e3e6ea");
    svg->text(x - 6, y + at + 4, label, "end", 9, "#555");
  }
  double written = -1e9;
  if (varied.numbers) {
    for (const auto& [at, label] : across.marks()) {
      if (at - written < 38) continue;
      svg->text(at, bottom + 14, label, "middle", 9, "#555");
      written = at;
    }
  } else {
    for (size_t i = 0; i < names.size(); ++i) {
      const double at = across.at(static_cast<double>(i));
      if (at - written < 44) continue;
      svg->text(at, bottom + 14, names[i].substr(0, 18), "middle", 9, "#555");
      written = at;
    }
  }
  for (size_t t = 0; t < trials.size(); ++t)
    svg->dot(across.at(places[t]), y + up.at(*trials[t]->value), 2.6, kBestInk);
  svg->text(x, y - 8,
            varied.key.size() > 34 ? "..." + varied.key.substr(varied.key.size() - 32) : varied.key,
            "start", 10);
}

std::string slices_svg(const std::vector<Varied>& keys, const std::vector<const Drawn*>& trials,
                       const std::vector<double>& values) {
  const Scale up(values, kPanelHigh - kTopRoom - kBelow, 0);
  Svg svg;
  const size_t columns = 3, n = std::min(keys.size(), kMostPanels);
  for (size_t k = 0; k < n; ++k)
    draw_slice(keys[k], trials, up, kLeft + static_cast<double>(k % columns) * (kPanelWide + 10),
               kTopRoom + static_cast<double>(k / columns) * kPanelHigh, &svg);
  return svg.document((kPanelWide + 10) * static_cast<double>(std::min(n, columns)) + 10,
                      kPanelHigh * static_cast<double>((n + columns - 1) / columns) + 6);
}

/// Which key mattered, and what its values gave.
void add_keys(const Sheet& sheet, std::vector<Section>* out) {
  std::vector<const Drawn*> trials;
  std::vector<double> values;
  for (const Drawn& one : sheet.trials)
    if (one.value) {
      trials.push_back(&one);
      values.push_back(*one.value);
    }
  const std::vector<Varied> keys = varied_keys(trials);
  if (keys.empty()) return;
  if (std::ssize(trials) >= search::kLeastTrialsForImportance) {
    const bool positive = *std::min_element(values.begin(), values.end()) > 0;
    std::vector<double> results = values;
    if (positive)
      for (double& value : results) value = std::log(value);
    std::vector<search::Factor> factors;
    for (const Varied& key : keys) factors.push_back(factor_of(key, results));
    const std::vector<double> shares = search::importance(factors, results);
    std::vector<std::pair<double, std::string>> ranked;
    double all = 0;
    const bool seeds =
        std::any_of(keys.begin(), keys.end(), [](const Varied& key) { return key.key == "seed"; });
    for (size_t k = 0; k < keys.size(); ++k) {
      ranked.emplace_back(shares[k], keys[k].key);
      all += shares[k];
    }
    std::stable_sort(ranked.begin(), ranked.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    out->push_back(
        {"Which key mattered",
         cat("The share of the variance of ", positive ? "log " : "", sheet.metric, " over ",
             trials.size(),
             " trials that a key explains by itself: main effects of a functional ANOVA (Hutter et "
             "al. 2014) on a forest of 64 regression trees. ",
             format("%.0f %%", 100 * std::max(0.0, 1 - all)),
             " are of keys together. Failed trials are left out.",
             seeds ? " The share of 'seed' shows what chance looks like." : "", "\n"),
         importance_svg(ranked)});
  }
  if (trials.size() > 2)
    out->push_back({"What each value gave", "", slices_svg(keys, trials, values)});
}

}  // namespace

std::vector<Section> sweep_pictures(const sweep::SweepDir& dir, const tables::Results& results) {
  std::vector<Section> out;
  const Sheet sheet = sheet_of(dir, results);
  std::string best;
  if (sheet.best) {
    const tables::TrialResult& trial = *sheet.trials[*sheet.best].trial;
    best =
        "Best: " + tables::short_number(*sheet.trials[*sheet.best].value) + ", trial " + trial.id +
        " " +
        joined(trial.overrides,
               [](const auto& one) { return one.first + "=" + tables::plain_text(one.second); }) +
        "\n";
  }
  const std::string curves = curves_svg(sheet), history = history_svg(sheet);
  if (!curves.empty()) out.push_back({"All trials", best, curves});
  if (!history.empty()) out.push_back({"Trial after trial", curves.empty() ? best : "", history});
  add_keys(sheet, &out);
  return out;
}

}  // namespace restage::report
