#include "train/artifacts/artifact_id.h"

#include <nlohmann/json.hpp>

#include "datasets/readers/sha256.h"

namespace restage {
namespace {

nlohmann::json keys_json(const ConfigNode& keys) {
  using Json = nlohmann::json;
  switch (keys.kind) {
    case ConfigNode::Kind::null:
      return nullptr;
    case ConfigNode::Kind::scalar:
      return keys.text;
    case ConfigNode::Kind::list: {
      Json out = Json::array();
      for (const ConfigNode& child : keys.children) out.push_back(keys_json(child));
      return out;
    }
    case ConfigNode::Kind::map:
      break;
  }
  Json out = Json::object();
  for (const ConfigNode& child : keys.children) out[child.key] = keys_json(child);
  return out;
}

}  // namespace

std::string keys_text(const ConfigNode& keys) { return keys_json(keys).dump(); }

std::string short_id(const std::string& text) { return sha256(text).substr(0, 12); }

}  // namespace restage
