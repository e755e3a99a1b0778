#include "train/run_provenance.h"

#include <algorithm>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "autograd/base/atomic_file.h"
#include "autograd/kernels/instruction_sets.h"
#include "nn/config/config_tree.h"

// The build defines these for this file; without them the answers are "unknown".
#ifndef RESTAGE_VERSION
#define RESTAGE_VERSION "unknown"
#endif
#ifndef RESTAGE_GIT_COMMIT
#define RESTAGE_GIT_COMMIT "unknown"
#endif
#ifndef RESTAGE_FLAGS
#define RESTAGE_FLAGS "unknown"
#endif

namespace restage {
namespace {

std::string compiler() {
#if defined(__clang__)
  return "clang " __clang_version__;
#elif defined(__GNUC__)
  return "gcc " __VERSION__;
#else
  return "unknown";
#endif
}

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.rfind("model name", 0) == 0 && line.find(": ") != std::string::npos)
      return line.substr(line.find(": ") + 2);
  return "unknown";
}

std::string now_utc() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  ::gmtime_r(&now, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

using Json = nlohmann::ordered_json;

void flatten(const ConfigNode& node, const std::string& key, Json* out) {
  if (node.kind == ConfigNode::Kind::scalar || node.kind == ConfigNode::Kind::null)
    (*out)[key] = node.text;
  size_t index = 0;
  for (const ConfigNode& child : node.children) {
    const std::string& name = child.key.empty() ? std::to_string(index++) : child.key;
    flatten(child, key.empty() ? name : key + "." + name, out);
  }
}

/// {"dotted.key": "value"}
Json flat(const std::string& yaml) {
  Json out = Json::object();
  flatten(parse_yaml(yaml, "config.yaml"), "", &out);
  return out;
}

[[noreturn]] void refuse(const std::string& dir, const std::string& what) {
  throw InputError(dir, what + " since the run began",
                   "put it back as it was, or train anew (stages can be taken over: STAGE.from=, "
                   "STAGE.init=)");
}

}  // namespace

std::string provenance_json(const RunInput& input) {
  nlohmann::ordered_json json = {{"version", RESTAGE_VERSION},
                                 {"git_commit", RESTAGE_GIT_COMMIT},
                                 {"compiler", compiler()},
                                 {"flags", RESTAGE_FLAGS},
                                 {"processor", processor()},
                                 {"cores", std::thread::hardware_concurrency()},
                                 {"simd", instruction_set()},
                                 {"threads", input.threads},
                                 {"seed", input.seed},
                                 {"data", nlohmann::ordered_json::array()},
                                 {"command_line", input.command_line},
                                 {"started", now_utc()}};
  for (const auto& file : input.data)
    json["data"].push_back(
        nlohmann::ordered_json{{"path", file.path}, {"checksum", file.checksum}});
  json["configuration"] = flat(input.resolved_yaml);
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

void check_same_run(const std::string& dir, const RunInput& input) {
  const std::string path = dir + "/provenance.json";
  const Json then = Json::parse(read_file(path, 1 << 22), nullptr, false);
  if (!then.is_object() || !then.contains("configuration") || !then["configuration"].is_object() ||
      !then.contains("data") || !then["data"].is_array())
    throw InputError(path, "does not say what the run was made of",
                     "resume it with the version of restage that began it");
  const Json now = flat(input.resolved_yaml);
  for (const auto& [key, value] : then["configuration"].items())
    if (!now.contains(key) || now[key] != value)
      refuse(dir, "'" + key + "' of config.yaml has changed from " + value.dump());
  for (const auto& [key, value] : now.items())
    if (!then["configuration"].contains(key)) refuse(dir, "'" + key + "' of config.yaml is new");
  std::vector<std::string> sums;
  for (const Json& file : then["data"]) sums.push_back(file.value("checksum", ""));
  for (size_t i = 0; i < std::max(sums.size(), input.data.size()); ++i)
    if (i >= sums.size() || i >= input.data.size() || sums[i] != input.data[i].checksum)
      refuse(dir, "the data" +
                      (i < input.data.size() ? " in " + input.data[i].path : std::string()) +
                      " have changed");
}

}  // namespace restage
