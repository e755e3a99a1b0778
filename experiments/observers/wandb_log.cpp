#include "experiments/observers/wandb_log.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"

namespace restage {
namespace {

constexpr size_t kBlock = 32768, kPartHeader = 7;
constexpr char kFull = 1, kFirst = 2, kMiddle = 3, kLast = 4;  // kinds of parts
// Fields of the message Record.
constexpr int kHistory = 2, kSummary = 3, kConfig = 5, kMetric = 12, kRun = 17, kExit = 18,
              kFinal = 20, kHeader = 21, kFooter = 22;
constexpr int kValueJson = 16;  // of an item of history, summary and config

Message item(const std::string& key, const std::string& json) {
  return Message().bytes(1, key).bytes(kValueJson, json);
}

std::string json_number(double value) { return nlohmann::json(value).dump(); }

Message config_of(const RunFacts& facts) {
  Message out;
  for (const auto& [key, json] : facts.config) out.message(1, item(key, json));
  return out;
}

Message time_stamp(double time) {
  const double whole = std::floor(time);
  return Message()
      .number(1, static_cast<uint64_t>(whole))
      .number(2, static_cast<uint64_t>(1e9 * (time - whole)));
}

std::string date_of(double time) {
  const auto seconds = static_cast<std::time_t>(time);
  std::tm parts{};
  ::gmtime_r(&seconds, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y%m%d_%H%M%S", &parts);
  return text;
}

}  // namespace

RecordLog::RecordLog(std::string path) : path_(std::move(path)) {
  file_.reset(std::fopen(path_.c_str(), "wb"));
  if (file_ == nullptr) throw_unwritable(path_, errno);
  write(std::string(":W&B") + as_bytes<uint16_t>(0xBEE1) + '\0');
}

void RecordLog::write(std::string_view bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size())
    throw_unwritable(path_, errno);
  at_ = (at_ + bytes.size()) % kBlock;
}

void RecordLog::part(char kind, std::string_view bytes) {
  constexpr uint32_t kZlib = 0xedb88320u;
  static const CheckSum sum(kZlib);
  write(as_bytes(sum.of(kind + std::string(bytes))) +
        as_bytes(static_cast<uint16_t>(bytes.size())) + kind);
  write(bytes);
}

void RecordLog::add(const std::string& record) {
  if (const size_t left = kBlock - at_; left < kPartHeader) write(std::string(left, '\0'));
  std::string_view rest = record;
  const auto room = [this] { return kBlock - at_ - kPartHeader; };
  if (rest.size() <= room()) return part(kFull, rest);
  for (char kind = kFirst; rest.size() > room(); kind = kMiddle) {
    const std::string_view some = rest.substr(0, room());
    rest.remove_prefix(some.size());
    part(kind, some);
  }
  part(kLast, rest);
}

void RecordLog::flush() {
  if (std::fflush(file_.get()) != 0) throw_unwritable(path_, errno);
}

WandbLog::WandbLog(RunFacts facts) : facts_(std::move(facts)), id_(facts_.id.substr(0, 8)) {
  folder_ = facts_.dir + "/wandb/offline-run-" + date_of(facts_.started) + "-" + id_;
}

void WandbLog::record(int field, const Message& message) {
  file_->add(Message().number(1, records_++).message(field, message).text());
}

void WandbLog::begin(const std::vector<LogLine>& lines) {
  make_folder(folder_ + "/files");
  const std::string path = folder_ + "/run-" + id_ + ".wandb";
  std::error_code ignored;  // wandb's mark of a file that has been sent, which this one has not
  std::filesystem::remove(path + ".synced", ignored);
  file_ = std::make_unique<RecordLog>(path);
  known_.clear();
  records_ = rows_ = 0;
  const std::string shown = std::filesystem::absolute(facts_.dir).lexically_normal().filename();
  record(kHeader, Message());
  record(kRun, Message()
                   .bytes(1, id_)
                   .bytes(3, facts_.name)
                   .message(4, config_of(facts_))
                   .bytes(8, shown.empty() ? id_ : shown)
                   .message(17, time_stamp(facts_.started)));
  record(kConfig, config_of(facts_));
  for (const LogLine& line : lines) put(line);
  file_->flush();
}

/// The first time that a key appears: its axis.
void WandbLog::define(const std::string& key, const std::string& axis) {
  if (!known_.insert(key).second) return;
  Message metric = Message().bytes(1, key);
  if (!axis.empty()) metric.bytes(4, axis);
  record(kMetric, metric.message(6, Message().number(3, 1)));
}

void WandbLog::put(const LogLine& line) {
  const std::string axis = line.stage + "/step";
  define(axis, "");
  Message row, newest;
  const auto say = [&](const std::string& key, const std::string& json) {
    row.message(1, item(key, json));
    newest.message(1, item(key, json));
  };
  for (const auto& [name, value] : line.values) {
    define(line.stage + "/" + name, axis);
    say(line.stage + "/" + name, json_number(value));
  }
  say(axis, std::to_string(line.step));
  say("_step", std::to_string(rows_));
  say("_timestamp", json_number(line.time));
  say("_runtime", json_number(std::max(0.0, line.time - facts_.started)));
  record(kHistory, row.message(2, Message().number(1, rows_++)));
  record(kSummary, newest);
}

void WandbLog::add(const LogLine& line) {
  put(line);
  file_->flush();
}

void WandbLog::end(RunEnd how, double time) {
  const auto runtime = static_cast<uint64_t>(std::max(0.0, time - facts_.started));
  record(kExit, Message().number(1, how == RunEnd::finished ? 0 : 1).number(2, runtime));
  record(kFinal, Message());
  record(kFooter, Message());
  file_->flush();
}

}  // namespace restage
