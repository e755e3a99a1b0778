#include "train/artifacts/store.h"

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "autograd/base/atomic_file.h"
#include "autograd/base/log.h"
#include "datasets/readers/sha256.h"
#include "train/artifacts/made_once.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kFiles[] = {"weights.safetensors", "config.yaml", "metrics.jsonl"};

/// What is wrong with the artifact in `folder`, by the bytes that were read; nothing if it is
/// whole. ReadError if they cannot be read.
std::string damage(const std::string& folder) {
  if (!is_there(folder + "/artifact.json")) return "artifact.json is missing";
  const Json json = Json::parse(read_file(folder + "/artifact.json"), nullptr, false);
  if (!json.is_object() || !json.contains("files") || !json["files"].is_object())
    return "artifact.json is damaged";
  for (const char* name : kFiles) {
    const std::string file = folder + "/" + name;
    const auto sum = json["files"].find(name);
    if (sum == json["files"].end() || !is_there(file)) return std::string(name) + " is missing";
    if (*sum != sha256_of_file(file)) return std::string(name) + " does not fit its checksum";
  }
  return "";
}

/// The validation of the weights that a stage hands on: the last line of its metrics, or the line
/// of the step which that line names as the best.
Json validation_of(const std::string& metrics) {
  std::istringstream lines(metrics);
  std::map<int64_t, Json> last;  // the last line of each step
  Json out;
  for (std::string text; std::getline(lines, text);) {
    out = Json::parse(text, nullptr, false);
    if (!out.is_object() || !out.contains("step")) return nullptr;
    last[out["step"]] = out;
  }
  const auto best = out.is_object() ? out.find("best_step") : out.end();
  return best == out.end() ? out : last[*best];
}

RunDir open_run(const std::string& folder, const std::string& stage, const std::string& yaml,
                const std::string& facts) {
  if (is_there(folder + "/config.yaml")) return RunDir::resume(folder, {stage});
  std::error_code ignored;
  fs::remove_all(folder, ignored);
  return RunDir::create_at(folder, yaml, facts, {stage});
}

}  // namespace

std::string Store::path(const StageId& id) const { return (fs::path(dir_) / id.name()).string(); }

std::string Store::partial(const StageId& id) const {
  return path_aside(dir_, id.name(), ".partial");
}

std::string Store::answers() const { return (fs::path(dir_) / "answers").string(); }

std::string Store::metrics(const StageId& id) const {
  for (const std::string& folder : {path(id), partial(id)}) {
    const std::string file = folder + "/metrics.jsonl";
    if (is_there(file)) return read_file(file);
  }
  return "";
}

bool Store::has(const StageId& id) const { return is_there(path(id) + "/artifact.json"); }

std::optional<Bundle> Store::find(const StageId& id) const {
  const std::string folder = path(id), aside = folder + ".damaged";
  if (!is_there(folder)) return std::nullopt;
  std::string wrong;
  try {
    wrong = damage(folder);
    if (wrong.empty()) return load_bundle(folder);
  } catch (const ReadError& reading) {
    if (!reading.absent()) throw;
    return std::nullopt;  // another process has just moved it aside
  }
  log_warning(folder + " is damaged (" + wrong + ") and will be made again");
  std::error_code error;
  fs::remove_all(aside, error);
  fs::rename(folder, aside, error);
  if (error && is_there(folder)) throw_refused(folder, "moved aside", error.value());
  return std::nullopt;
}

Bundle Store::get(const StageId& id, const std::string& config_yaml, const Make& make) const {
  return made_once<Bundle>(
      dir_, id.name(), [&] { return find(id); },
      [&](const Lease& lease) {
        const std::string aside = partial(id);
        Bundle bundle;
        {
          RunDir run = open_run(aside, id.stage, config_yaml, id.facts);
          bundle = make(run);
        }
        if (lease.lost())
          throw WorkError("another process has taken over " + id.name() + "; run it again");
        publish(id, aside, config_yaml, bundle);
      });
}

void Store::publish(const StageId& id, const std::string& run, const std::string& config_yaml,
                    const Bundle& bundle) const {
  Temporary draft(name_beside(path(id), "."));
  const fs::path ready = draft.path();
  std::error_code error;
  if (!fs::create_directory(ready, error) || error)
    throw WorkError(ready.string() + ": could not be made (" + error.message() +
                    "); free some space and run it again");
  const std::string metrics = read_file((fs::path(run) / "metrics.jsonl").string());
  save_bundle((ready / "weights.safetensors").string(), bundle);
  write_file_atomically((ready / "config.yaml").string(), config_yaml);
  write_file_atomically((ready / "metrics.jsonl").string(), metrics);
  Json json = {{"id", id.id}, {"stage", id.stage}, {"made_from", Json::parse(id.facts)}};
  json["metrics"] = validation_of(metrics);
  for (const char* name : kFiles) json["files"][name] = sha256_of_file((ready / name).string());
  write_file_atomically((ready / "artifact.json").string(), json.dump(2) + "\n");
  fs::rename(ready, path(id), error);
  if (error)
    throw WorkError(path(id) + ": could not be put into the store (" + error.message() +
                    "); run it again");
  draft.keep();
}

}  // namespace restage
