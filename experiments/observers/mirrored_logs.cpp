#include "experiments/observers/mirrored_logs.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "autograd/base/atomic_file.h"
#include "autograd/base/format.h"
#include "autograd/base/host.h"
#include "autograd/base/words.h"
#include "datasets/readers/sha256.h"
#include "nn/config/config_tree.h"

namespace restage {
namespace {

using OrderedJson = nlohmann::ordered_json;

/// Whole milliseconds, as metrics.times has them.
double seconds_now() {
  using namespace std::chrono;
  const auto now = duration_cast<milliseconds>(system_clock::now().time_since_epoch()).count();
  return static_cast<double>(now) / 1000;  // the double that its text is read as
}

OrderedJson json_of(const ConfigNode& node) {
  if (node.kind == ConfigNode::Kind::null) return nullptr;
  if (node.kind == ConfigNode::Kind::scalar) {
    const OrderedJson value =
        node.quoted ? OrderedJson(node.text) : OrderedJson::parse(node.text, nullptr, false);
    return value.is_discarded() ? OrderedJson(node.text) : value;
  }
  const bool map = node.kind == ConfigNode::Kind::map;
  OrderedJson out = map ? OrderedJson::object() : OrderedJson::array();
  for (const ConfigNode& child : node.children)
    map ? out[child.key] = json_of(child) : (out.push_back(json_of(child)), nullptr);
  return out;
}

void put_keys(const ConfigNode& section, const std::string& prefix, RunFacts* out) {
  for (const ConfigNode& child : section.children) {
    if (child.kind == ConfigNode::Kind::map)
      put_keys(child, prefix + child.key + ".", out);
    else
      out->config.emplace_back(
          prefix + child.key,
          json_of(child).dump(-1, ' ', false, OrderedJson::error_handler_t::replace));
  }
}

double seconds_of(const std::string& utc) {
  std::tm parts{};
  return ::strptime(utc.c_str(), "%Y-%m-%dT%H:%M:%SZ", &parts) == nullptr
             ? seconds_now()
             : static_cast<double>(::timegm(&parts));
}

std::vector<LogLine> lines_of(const std::string& path) {
  std::istringstream text(read_file(path));
  std::vector<LogLine> out;
  for (std::string one; std::getline(text, one);) {
    const auto json = OrderedJson::parse(one);
    LogLine line{json["stage"].get<std::string>(), json["step"].get<int64_t>(), {}, 0};
    for (const auto& [name, value] : json.items())
      if (name != "stage" && name != "step" && value.is_number())
        line.values.emplace_back(name, value.get<double>());
    out.push_back(std::move(line));
  }
  return out;
}

/// What metrics.times says: an id, "" if there is none yet, and the times of lines.
std::pair<std::string, std::vector<double>> times_of(const std::string& path) {
  std::pair<std::string, std::vector<double>> out;
  if (!is_there(path)) return out;
  std::istringstream text(read_file(path));
  std::getline(text, out.first);
  if (!is_sha256(out.first)) return {};
  for (double time = 0; text >> time;) out.second.push_back(time);
  return out;
}

std::string times_path(const std::string& run) { return run + "/metrics.times"; }

std::string time_text(double time) { return format("%.3f\n", time); }

}  // namespace

RunFacts run_facts(const std::string& dir, const std::string& name, const std::string& yaml) {
  const auto provenance = OrderedJson::parse(read_file(dir + "/provenance.json", 1 << 22));
  const std::string started = provenance.value("started", "");
  RunFacts out{dir, name, times_of(times_path(dir)).first, seconds_of(started), {}};
  if (out.id.empty())
    out.id = sha256(cat(std::filesystem::absolute(dir).string(), " ", host_name(), " ", ::getpid(),
                        " ", seconds_now()));
  put_keys(parse_yaml(yaml, "config.yaml"), "", &out);
  return out;
}

MirroredLogs::MirroredLogs(const RunFacts& run, std::vector<std::unique_ptr<MirroredLog>> logs)
    : times_(times_path(run.dir)), logs_(std::move(logs)) {
  std::vector<LogLine> lines = lines_of(run.dir + "/metrics.jsonl");
  const std::vector<double> times = times_of(times_).second;
  const double now = seconds_now();
  std::string text = run.id + "\n";
  for (size_t i = 0; i < lines.size(); ++i) {
    lines[i].time = i < times.size() ? times[i] : now;
    text += time_text(lines[i].time);
  }
  write_file_atomically(times_, text);
  for (const auto& log : logs_) log->begin(lines);
}

void MirroredLogs::add(const std::string& stage, int64_t done, const NamedValues& values) {
  LogLine line{stage, done, {}, seconds_now()};
  for (const auto& one : values)
    if (std::isfinite(one.second)) line.values.push_back(one);
  const int file = ::open(times_.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  const int code = file < 0 ? errno : write_all(file, time_text(line.time));
  if (file >= 0) ::close(file);
  if (code != 0) throw_unwritable(times_, code);
  for (const auto& log : logs_) log->add(line);
}

void MirroredLogs::on_log(const Stage& stage, int64_t done, const NamedValues& values) {
  add(stage.name(), done, values);
}

void MirroredLogs::on_validation(Stage& stage, int64_t done, const NamedValues& figures) {
  add(stage.name(), done, figures);
}

void MirroredLogs::end(RunEnd how) {
  for (const auto& log : logs_) log->end(how, seconds_now());
}

}  // namespace restage
