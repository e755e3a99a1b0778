#include "experiments/sweep/live.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "autograd/base/format.h"
#include "autograd/base/words.h"
#include "experiments/sweep/svg.h"
#include "experiments/text.h"
#include "nn/config/config_tree.h"
#include "train/progress.h"

namespace restage::sweep {
namespace {

constexpr double kPaceWindow = 30;  ///< seconds

/// The step of the last line of a metrics.jsonl that has one.
int64_t last_step(const std::string& metrics) {
  std::istringstream lines(metrics);
  int64_t out = 0;
  for (std::string line; std::getline(lines, line);) {
    const size_t at = line.find("\"step\":");
    if (at != std::string::npos) out = std::max<int64_t>(out, std::atoll(line.c_str() + at + 7));
  }
  return out;
}

int64_t steps_of(const ConfigNode& config, const std::string& stage) {
  const ConfigNode* steps = find_config(config, stage + ".optimiser.steps");
  return steps == nullptr ? 0 : std::max<int64_t>(0, std::atoll(steps->text.c_str()));
}

RunningTrial running_trial(const SweepDir& dir, const TrialEntry& trial, const LeaseHolder& holder,
                           const std::string& metric) {
  RunningTrial out;
  out.trial = trial;
  out.holder = holder.text();
  out.seconds = static_cast<double>(holder.beat);  // a trial's heart beats every second
  ConfigNode config;
  try {
    config = load_config_tree(dir.folder(trial.id) + "/config.yaml");
  } catch (const Error&) {  // somebody plans the sweep again
  }
  const Store store(store_of(dir));
  for (const auto& [stage, id] : trial.artifacts) {
    const StageId name{stage, id, ""};
    const int64_t steps = steps_of(config, stage);
    const int64_t step = std::min(last_step(store.metrics(name)), steps);
    const bool there = store.has(name);
    out.all += steps;
    out.done += there ? steps : step;
    if (there || !out.stage.empty()) continue;
    out.stage = stage;
    out.step = step;
    out.steps = steps;
  }
  out.curve = curve_of(dir, trial, std::nullopt, metric);
  if (!out.curve.empty()) out.now = out.curve.back().value;
  return out;
}

/// Counts a trial, and adds it to those that run. What it came to; nothing if it is not over.
std::optional<DoneTrial> count_in(const SweepDir& dir, const TrialEntry& trial, DoneTrials& known,
                                  LiveSweep* out) {
  std::error_code absent;
  const auto written = std::filesystem::last_write_time(dir.result(trial.id), absent);
  const auto found = known.find(trial.id);
  if (!absent && found != known.end() && found->second.written == written) {
    ++out->counts["done"];
    return found->second;
  }
  const TrialStatus status = status_of(dir, trial);
  ++out->counts[status.state];
  if (status.state == "running" && status.holder)
    out->running.push_back(running_trial(dir, trial, *status.holder, out->metric));
  if (status.state == "running" || status.state == "pending") return std::nullopt;
  DoneTrial one{written, status.seconds, {}};
  if (!out->metric.empty())
    one.value = value_of(dir, trial, read_result(dir, trial.id), out->metric);
  if (status.state == "done" && !absent) known.insert_or_assign(trial.id, one);
  return one;
}

// ---- text ----

/// Columns on a terminal; a byte that goes on a character takes none.
size_t columns_of(const std::string& text) {
  return static_cast<size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

std::string cut_to(const std::string& text, int columns) {
  size_t seen = 0, at = 0;
  while (at < text.size()) {
    if ((text[at] & 0xC0) != 0x80 && seen++ == static_cast<size_t>(std::max(0, columns))) break;
    ++at;
  }
  return text.substr(0, at);
}

std::string padded(std::string text, size_t columns) {
  while (columns_of(text) < columns) text += ' ';
  return text;
}

std::string bar(double share, int cells) {
  const int full = static_cast<int>(std::clamp(share, 0.0, 1.0) * cells);
  std::string out;
  for (int i = 0; i < cells; ++i) out += i < full ? "█" : "░";
  return out;
}

std::string values_text(const TrialEntry& trial) {
  std::vector<std::string> parts;
  if (!trial.case_name.empty()) parts.push_back(trial.case_name);
  for (const auto& [key, value] : trial.overrides)
    parts.push_back(key.substr(key.rfind('.') + 1) + "=" + tables::plain_text(value));
  parts.push_back(cat("seed ", trial.seed));
  return on_one_line(joined(parts));
}

std::string best_text(const LiveSweep& live) {
  if (!live.best) return "best   none yet";
  return "best   " + tables::short_number(live.best->value) + " " + live.metric + "  " +
         live.best->trial.id + "  " + values_text(live.best->trial);
}

std::string head_text(const LiveSweep& live, const std::string& name) {
  std::vector<std::string> parts;
  for (const char* state : {"done", "failed", "stopped", "running", "pending"})
    if (const auto found = live.counts.find(state);
        found != live.counts.end() && (found->second > 0 || state == std::string("done")))
      parts.push_back(cat(found->second, " ", state));
  if (live.to_come > 0) parts.push_back(cat(live.to_come, " to be asked for"));
  std::string out = on_one_line(name) + "   " + joined(parts);
  if (live.left) out += "   about " + duration_text(*live.left) + " left";
  return out;
}

/// What the columns of running trials take; a line of 80 columns ends with the curve.
struct Layout {
  size_t bar = 16, curve = 20;
  size_t stage = 11, left = 8, number = 8;
};

Layout layout_for(int columns) {
  constexpr int kRoomy = 110;
  Layout out;
  if (columns > 0 && columns < kRoomy) out.bar = out.curve = 10;
  return out;
}

std::string heading_text(const Layout& at) {
  return padded("trial", 12) + " " + padded("stage", at.stage) + " " + padded("", at.bar + 6) +
         padded("left", at.left) + " " + padded("now", at.number) + " " +
         padded("best", at.number) + " " + padded("", at.curve) + "  values";
}

std::string trial_text(const RunningTrial& one, const Layout& at) {
  const double share =
      one.steps > 0 ? static_cast<double>(one.step) / static_cast<double>(one.steps) : 0;
  std::string out = one.trial.id + " ";
  out += padded(one.stage.empty() ? "measuring" : one.stage, at.stage) + " ";
  if (one.stage.empty())
    out += padded("", at.bar + 5);
  else
    out += bar(share, static_cast<int>(at.bar)) + format("%3.0f %%", 100 * share);
  out += " " + padded(one.left ? duration_text(*one.left) : "", at.left);
  double best = INFINITY;
  std::vector<double> values;
  for (const CurvePoint& point : one.curve) {
    best = std::min(best, point.value);
    values.push_back(point.value);
  }
  const auto number = [&](bool there, double value) {
    return " " + padded(there ? tables::short_number(value) : "", at.number);
  };
  out += number(one.now.has_value(), one.now.value_or(0)) + number(one.now.has_value(), best);
  out += " " + padded(blocks(values, at.curve), at.curve);
  return out + "  " + values_text(one.trial);
}

}  // namespace

bool LiveSweep::over() const {
  const auto count = [&](const char* state) {
    const auto found = counts.find(state);
    return found == counts.end() ? 0 : found->second;
  };
  return count("running") == 0 && count("pending") == 0 && to_come == 0;
}

LiveSweep look_at(const SweepDir& dir, const std::string& metric, DoneTrials* known) {
  LiveSweep out;
  out.metric = main_metric(dir, metric);
  for (const char* state : {"done", "failed", "stopped", "running", "pending"})
    out.counts[state] = 0;
  if (dir.search && dir.search->asks())
    out.to_come = std::max(0, dir.search->trials - static_cast<int>(dir.trials.size()));
  DoneTrials none;
  double seconds = 0;
  int timed = 0;
  for (const TrialEntry& trial : dir.trials) {
    const auto over = count_in(dir, trial, known == nullptr ? none : *known, &out);
    if (!over) continue;
    if (over->seconds > 0) seconds += over->seconds, ++timed;
    if (over->value && std::isfinite(*over->value) && (!out.best || *over->value < out.best->value))
      out.best = BestTrial{trial, *over->value};
  }
  const int left = out.counts["pending"] + out.to_come;
  if (timed > 0 && !out.running.empty()) {
    // What runs is on average half over.
    const double at_once = static_cast<double>(out.running.size());
    out.left = seconds / timed * (left + 0.5 * at_once) / at_once;
  }
  return out;
}

void Pace::fill_in(LiveSweep& live, double now) {
  for (RunningTrial& one : live.running) {
    std::vector<Seen>& seen = seen_[one.trial.id];
    if (seen.empty() || seen.back().done != one.done) seen.push_back({now, one.done});
    while (seen.size() > 2 && now - seen.front().time > kPaceWindow) seen.erase(seen.begin());
    const auto still = static_cast<double>(one.all - one.done);
    const Seen &first = seen.front(), &last = seen.back();
    if (last.done > first.done && last.time > first.time)
      one.left = still * (last.time - first.time) / static_cast<double>(last.done - first.done) -
                 (now - last.time);
    else if (one.done > 0 && one.seconds > 0)
      one.left = still * one.seconds / static_cast<double>(one.done);
    if (one.left) one.left = std::max(0.0, *one.left);
  }
}

std::vector<std::string> picture(const LiveSweep& live, const std::string& name, int columns,
                                 int rows) {
  std::vector<std::string> out = {head_text(live, name), best_text(live)};
  const Layout layout = layout_for(columns);
  if (!live.running.empty()) out.push_back(heading_text(layout));
  // The lines above, the cursor's, and one that says how many are not shown.
  size_t shown = live.running.size();
  if (rows > 0 && shown + out.size() + 1 > static_cast<size_t>(rows))
    shown = static_cast<size_t>(std::max(0, rows - static_cast<int>(out.size()) - 2));
  for (size_t i = 0; i < shown; ++i) out.push_back(trial_text(live.running[i], layout));
  if (shown < live.running.size()) out.push_back(cat("and ", live.running.size() - shown, " more"));
  for (std::string& line : out) {
    line = columns > 0 ? cut_to(line, columns) : line;
    line.erase(line.find_last_not_of(' ') + 1);
  }
  return out;
}

std::string blocks(const std::vector<double>& values, size_t width) {
  static const char* const cells[] = {"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  const size_t n = std::min(width, values.size());
  std::vector<double> shown;
  for (size_t i = 0; i < n; ++i)
    shown.push_back(values[n == 1 ? values.size() - 1 : i * (values.size() - 1) / (n - 1)]);
  double low = INFINITY, high = -INFINITY;
  for (const double value : shown)
    if (std::isfinite(value)) {
      low = std::min(low, value);
      high = std::max(high, value);
    }
  std::string out;
  for (const double value : shown) {
    const double share = high > low ? (value - low) / (high - low) : 0;
    out += std::isfinite(value) ? cells[std::min<size_t>(7, static_cast<size_t>(share * 8))] : "x";
  }
  return out;
}

}  // namespace restage::sweep
