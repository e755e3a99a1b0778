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

/// What a run says of itself.
Json begun(const std::string& dir) {
  const std::string path = dir + "/provenance.json";
  Json out = Json::parse(read_file(path, 1 << 22), nullptr, false);
  if (!out.is_object() || !out.contains("configuration") || !out["configuration"].is_object() ||
      !out.contains("data") || !out["data"].is_array())
    throw InputError(path, "does not say what the run was made of",
                     "resume it with the version of restage that began it");
  return out;
}

/// Takes away entries of maps of which `known` has no value. Lists stay or go whole.
void keep_known(const Json& known, const std::string& path, ConfigNode* node) {
  std::erase_if(node->children, [&](ConfigNode& child) {
    const std::string name = path.empty() ? child.key : path + "." + child.key;
    Json values = Json::object();
    flatten(child, name, &values);
    if (child.kind == ConfigNode::Kind::map) keep_known(known, name, &child);
    bool any = values.empty();
    for (const auto& item : values.items()) any = any || known.contains(item.key());
    return !any;
  });
}

/// A run that an earlier version began does not say what its networks were.
void check_sources(const std::string& dir, const Json& then, const RunInput& input) {
  const auto known = then.find("networks");
  if (known == then.end() || !known->is_object()) return;
  for (const RunInput::Network& network : input.networks) {
    const auto entry = known->find(network.stage);
    if (entry == known->end() || !entry->is_object()) continue;
    const auto source = entry->find("source");
    if (source != entry->end() && *source != network.source)
      refuse(dir, "the source of the network '" + network.model + "' has changed");
  }
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
  for (const auto& network : input.networks)
    json["networks"][network.stage] = {{"model", network.model}, {"source", network.source}};
  json["configuration"] = flat(input.resolved_yaml);
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

ConfigNode known_then(const std::string& dir, ConfigNode tree) {
  keep_known(begun(dir)["configuration"], "", &tree);
  return tree;
}

void check_same_run(const std::string& dir, const RunInput& input,
                    const std::vector<std::string>& overrides, const std::string& defaults) {
  const auto overridden = [&](const std::string& key) {
    return std::any_of(overrides.begin(), overrides.end(), [&](const std::string& text) {
      const std::string own = text.substr(0, text.find('='));
      return key == own || key.starts_with(own + ".");  // an item of a list
    });
  };
  const Json then = begun(dir), now = flat(input.resolved_yaml), usual = flat(defaults);
  for (const auto& [key, value] : then["configuration"].items())
    if (!overridden(key) && (!now.contains(key) || now[key] != value))
      refuse(dir, "'" + key + "' of config.yaml has changed from " + value.dump());
  for (const auto& [key, value] : now.items()) {
    if (then["configuration"].contains(key) || overridden(key)) continue;
    if (!usual.contains(key) || usual[key] != value)
      refuse(dir, "'" + key + "' of config.yaml is new and not its default");
  }
  check_sources(dir, then, input);
  std::vector<std::string> sums;
  for (const Json& file : then["data"]) sums.push_back(file.value("checksum", ""));
  for (size_t i = 0; i < std::max(sums.size(), input.data.size()); ++i)
    if (i >= sums.size() || i >= input.data.size() || sums[i] != input.data[i].checksum)
      refuse(dir, "the data" +
                      (i < input.data.size() ? " in " + input.data[i].path : std::string()) +
                      " have changed");
}

}  // namespace restage
