#include "experiments/observers/mlflow_log.h"

#include <fcntl.h>
#include <unistd.h>

#include <cctype>
#include <cerrno>
#include <charconv>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "autograd/base/atomic_file.h"
#include "autograd/base/format.h"
#include "autograd/base/words.h"
#include "datasets/readers/sha256.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
constexpr int kRunning = 1, kFinished = 3, kFailed = 4, kKilled = 5;  // mlflow's RunStatus
constexpr size_t kLongestParameter = 6000;                            // mlflow refuses longer ones

std::string in_yaml(const std::string& text) {  // a text of JSON is one of YAML
  return nlohmann::json(text).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

std::string milliseconds(double time) {
  return std::to_string(static_cast<long long>(1000 * time));
}

/// file:///... of a path.
std::string address_of(const std::string& path) {
  std::string out = "file://";
  for (const char c : path) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain = std::isalnum(byte) != 0 || std::string_view("/-_.~").find(c) < 5;
    out += plain ? std::string(1, c) : format("%%%02X", int{byte});
  }
  return out;
}

/// 18 digits, as MLflow makes them.
std::string number_of(const std::string& experiment) {
  uint64_t value = 0;
  const std::string digits = sha256(experiment).substr(0, 15);
  std::from_chars(digits.data(), digits.data() + digits.size(), value, 16);
  return std::to_string(100'000'000'000'000'000 + value % 900'000'000'000'000'000);
}

std::string point(double value, const LogLine& line) {
  return milliseconds(line.time) + " " + nlohmann::json(value).dump() + " " +
         std::to_string(line.step) + "\n";
}

/// `how`: O_APPEND or O_TRUNC.
void write(const std::string& path, const std::string& text, int how) {
  const int file = ::open(path.c_str(), O_CREAT | O_WRONLY | O_CLOEXEC | how, 0644);
  const int code = file < 0 ? errno : write_all(file, text);
  if (file >= 0) ::close(file);
  if (code != 0) throw_unwritable(path, code);
}

/// A value of JSON as a parameter shows it: texts without their quotes.
std::string shown(const std::string& json) {
  const auto value = nlohmann::json::parse(json, nullptr, false);
  return (value.is_string() ? value.get<std::string>() : json).substr(0, kLongestParameter);
}

}  // namespace

MlflowLog::MlflowLog(RunFacts facts) : facts_(std::move(facts)), id_(facts_.id.substr(0, 32)) {
  facts_.dir = fs::absolute(facts_.dir).lexically_normal().string();
  while (facts_.dir.size() > 1 && facts_.dir.back() == '/') facts_.dir.pop_back();
  store_ = (fs::path(facts_.dir).parent_path() / "mlruns").string();
  experiment_ = number_of(facts_.name);
  folder_ = store_ + "/" + experiment_ + "/" + id_;
}

void MlflowLog::begin(const std::vector<LogLine>& lines) {
  for (const char* part : {"/params", "/tags", "/artifacts"}) make_folder(folder_ + part);
  const std::string meta = store_ + "/" + experiment_ + "/meta.yaml";
  const std::string began = milliseconds(facts_.started);
  if (!is_there(meta))
    write_file_atomically(
        meta, cat("artifact_location: ", in_yaml(address_of(store_ + "/" + experiment_)),
                  "\ncreation_time: ", began, "\nexperiment_id: '", experiment_,
                  "'\nlast_update_time: ", began,
                  "\nlifecycle_stage: active\nname: ", in_yaml(facts_.name), "\n"));
  write_meta(kRunning, 0);
  const std::string name = fs::path(facts_.dir).filename().string();
  const std::pair<const char*, std::string> tags[] = {{"mlflow.runName", name},
                                                      {"mlflow.source.name", "restage train"},
                                                      {"mlflow.source.type", "LOCAL"},
                                                      {"restage.run", facts_.dir}};
  for (const auto& [tag, value] : tags) write(folder_ + "/tags/" + tag, value, O_TRUNC);
  for (const auto& [key, json] : facts_.config)
    write(folder_ + "/params/" + key, shown(json), O_TRUNC);
  std::error_code ignored;
  fs::remove_all(folder_ + "/metrics", ignored);
  make_folder(folder_ + "/metrics");
  std::map<std::string, std::string> files;
  for (const LogLine& line : lines)
    for (const auto& [key, value] : line.values) files[place_of(line, key)] += point(value, line);
  for (const auto& [path, text] : files) {
    make_folder(fs::path(path).parent_path().string());
    write(path, text, O_APPEND);
  }
}

void MlflowLog::add(const LogLine& line) {
  make_folder(folder_ + "/metrics/" + line.stage);
  for (const auto& [name, value] : line.values)
    write(place_of(line, name), point(value, line), O_APPEND);
}

void MlflowLog::end(RunEnd how, double time) {
  write_meta(how == RunEnd::finished  ? kFinished
             : how == RunEnd::stopped ? kKilled
                                      : kFailed,
             time);
}

/// `ended`: 0 while it runs.
void MlflowLog::write_meta(int status, double ended) {
  const std::string name = fs::path(facts_.dir).filename().string();
  write_file_atomically(
      folder_ + "/meta.yaml",
      cat("artifact_uri: ", in_yaml(address_of(folder_ + "/artifacts")),
          "\ndeleted_time: null\nend_time: ", ended > 0 ? milliseconds(ended) : "null",
          "\nentry_point_name: ''\nexperiment_id: '", experiment_,
          "'\nlifecycle_stage: active\nrun_id: ", id_, "\nrun_name: ", in_yaml(name),
          "\nrun_uuid: ", id_,
          "\nsource_name: ''\nsource_type: 4\nsource_version: ''\nstart_time: ",
          milliseconds(facts_.started), "\nstatus: ", status, "\ntags: []\nuser_id: ''\n"));
}

}  // namespace restage
