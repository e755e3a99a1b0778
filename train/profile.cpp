#include "train/profile.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "autograd/base/format.h"
#include "autograd/base/log.h"
#include "autograd/base/words.h"
#include "autograd/kernels/kernel.h"
#include "train/phases.h"

namespace restage {
namespace {

using Ordered = nlohmann::ordered_json;

double clock_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Open {
  std::string name, module;
  OpWatcher::Kind kind;
  double start, inside;  // seconds of what began within it
};
/// What has begun and not ended on this thread.
std::vector<Open>& open_here() {
  thread_local std::vector<Open> out;
  return out;
}

int thread_number() {
  static std::atomic<int> threads{0};
  thread_local const int number = ++threads;
  return number;
}

const char* pass_of(OpWatcher::Kind kind) {
  return kind == OpWatcher::Kind::backward ? "backward" : "forward";
}

/// To the nanosecond.
double microseconds(double seconds) { return std::round(1e9 * seconds) / 1e3; }

double mebibytes(int64_t bytes) { return static_cast<double>(bytes) / 1048576.0; }

}  // namespace

TrainProfile::TrainProfile() : start_(clock_now()) { watch_ops(this); }

void TrainProfile::on_begin(const Stage& stage, int64_t) {
  end_stage();
  const std::lock_guard lock(several_threads_);
  tables_.push_back({});
  tables_.back().stage = stage.name();
  device_ = stage.device();
  stage_events_ = 0;
}

void TrainProfile::on_step(const Stage&, int64_t, const NamedValues&) { ++tables_.back().steps; }

void TrainProfile::begin(const char* name, const std::string& path, Kind kind) {
  const bool backward = kind == Kind::phase && std::string_view(name) == "backward";
  open_here().push_back({name, path, kind, clock_now(), 0});
  if (!backward) return;
  const std::lock_guard lock(several_threads_);
  if (tables_.empty()) return;
  StageTable& table = tables_.back();
  table.at_backward = std::max(table.at_backward, memory_stats(device_).in_use);
}

void TrainProfile::end() {
  std::vector<Open>& open = open_here();
  if (open.empty()) return;  // it began before anybody watched
  if (device_ != Device{}) backend(device_).synchronise();
  const Open one = std::move(open.back());
  open.pop_back();
  const double took = clock_now() - one.start;
  const bool op = one.kind != Kind::phase;
  if (!open.empty() && op) open.back().inside += took;
  const auto within = [&](std::string_view phase) {
    return std::any_of(open.begin(), open.end(),
                       [&](const Open& outer) { return outer.name == phase; });
  };
  const bool judged = within("validate");
  if (op && open.empty()) return;  // of no training
  const int64_t memory = memory_stats(device_).in_use;
  const std::lock_guard lock(several_threads_);
  if (tables_.empty()) return;
  StageTable& table = tables_.back();
  if (memory > table.peak) {
    table.peak = memory;
    table.peak_in = op ? cat("'", one.name, "' in ", one.module) : one.name;
  }
  if (!op) table.phases[one.name] += took;
  if (op && !judged) {
    Row& row = table.rows[{one.name, one.module, one.kind}];
    ++row.calls;
    row.seconds += took - one.inside;
  }
  if (stage_events_++ < kMostEvents)
    events_.push_back(
        {one.name, one.module, one.kind, thread_number(), one.start - start_, took, memory});
  else
    ++table.left_out;
}

std::vector<std::pair<TrainProfile::Key, TrainProfile::Row>> TrainProfile::sorted(
    const StageTable& table) {
  std::vector<std::pair<Key, Row>> out(table.rows.begin(), table.rows.end());
  std::stable_sort(out.begin(), out.end(), [](const auto& a, const auto& b) {
    return a.second.seconds > b.second.seconds;
  });
  return out;
}

std::vector<std::string> TrainProfile::lines(const StageTable& table) {
  const auto steps = static_cast<double>(std::max<int64_t>(1, table.steps));
  double whole = 0;
  for (const char* phase : {"draw", "forward", "backward", "optimiser"})
    if (const auto found = table.phases.find(phase); found != table.phases.end())
      whole += found->second;
  const auto share = [&](double seconds) { return 100 * seconds / std::max(whole, 1e-12); };
  std::string phases;
  for (size_t i = 0; i < kPhases; ++i) {
    const char* phase = name_of(static_cast<Phase>(i));
    if (const auto found = table.phases.find(phase); found != table.phases.end())
      phases +=
          format("%s %s %.3f ms", phases.empty() ? "" : ",", phase, 1e3 * found->second / steps);
  }
  std::vector<std::string> out;
  out.push_back(format("%s: profile of %lld steps; time a step, of all threads:%s",
                       table.stage.c_str(), static_cast<long long>(table.steps), phases.c_str()));
  out.push_back(
      format("%s: tensors take at most %.1f MiB (%s), and %.1f MiB when a backward pass "
             "begins, with all that the tape keeps",
             table.stage.c_str(), mebibytes(table.peak), table.peak_in.c_str(),
             mebibytes(table.at_backward)));
  out.push_back(format("%-24s %-40s %-8s %12s %10s %7s", "op", "module", "pass", "calls a step",
                       "ms a step", "share"));
  const auto rows = sorted(table);
  for (size_t i = 0; i < std::min(rows.size(), kRows); ++i) {
    const auto& [op, module, kind] = rows[i].first;
    const Row& row = rows[i].second;
    out.push_back(format("%-24s %-40s %-8s %12.1f %10.3f %5.1f %%", op.c_str(), module.c_str(),
                         pass_of(kind), static_cast<double>(row.calls) / steps,
                         1e3 * row.seconds / steps, share(row.seconds)));
  }
  if (rows.size() > kRows)
    out.push_back(cat("and ", rows.size() - kRows, " more, which the trace has"));
  return out;
}

void TrainProfile::end_stage() {
  if (tables_.empty()) return;
  for (const std::string& line : lines(tables_.back())) log_info(line);
}

void TrainProfile::finish() {
  watch_ops(nullptr);
  end_stage();
}

std::string TrainProfile::trace() const {
  Ordered events = Ordered::array();
  events.push_back({{"name", "process_name"},
                    {"ph", "M"},
                    {"pid", 1},
                    {"tid", 0},
                    {"args", {{"name", "restage train"}}}});
  int64_t memory = -1;
  for (const Event& e : events_) {
    const bool op = e.kind != Kind::phase;
    events.push_back({{"name", e.name},
                      {"cat", op ? pass_of(e.kind) : "phase"},
                      {"ph", "X"},
                      {"ts", microseconds(e.start)},
                      {"dur", microseconds(e.seconds)},
                      {"pid", 1},
                      {"tid", e.thread}});
    if (op) events.back()["args"] = {{"module", e.module}};
    if (e.memory == memory) continue;
    memory = e.memory;
    events.push_back({{"name", "tensors"},
                      {"ph", "C"},
                      {"ts", microseconds(e.start + e.seconds)},
                      {"pid", 1},
                      {"tid", 0},
                      {"args", {{"MiB", mebibytes(memory)}}}});
  }
  Ordered stages = Ordered::array();
  for (const StageTable& table : tables_) {
    Ordered rows = Ordered::array();
    for (const auto& [key, row] : sorted(table))
      rows.push_back({{"op", std::get<0>(key)},
                      {"module", std::get<1>(key)},
                      {"pass", pass_of(std::get<2>(key))},
                      {"calls", row.calls},
                      {"seconds", row.seconds}});
    stages.push_back({{"stage", table.stage},
                      {"steps", table.steps},
                      {"phases", table.phases},
                      {"peak_bytes", table.peak},
                      {"peak_in", table.peak_in},
                      {"bytes_at_backward", table.at_backward},
                      {"events_left_out", table.left_out},
                      {"ops", rows}});
  }
  const Ordered out = {
      {"traceEvents", events}, {"displayTimeUnit", "ms"}, {"otherData", {{"stages", stages}}}};
  return out.dump(-1, ' ', false, Ordered::error_handler_t::replace) + "\n";
}

}  // namespace restage
