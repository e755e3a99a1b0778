#include "nn/weights/bundle.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>

#include "autograd/base/nearest.h"
#include "autograd/base/shipped.h"
#include "autograd/base/words.h"
#include "nn/weights/state.h"

namespace restage {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kKey = "restage";
constexpr const char* kGiveWeights = "give a weights file that restage wrote";

/// The name of a role in a file's metadata.
std::string place_of(const std::string& role) {
  const std::string prefix = prefix_of(role);
  return prefix.substr(0, prefix.size() - 1);
}

std::string role_of(const std::string& place) { return place == "smrm" ? "motion" : place; }

// ---- sizes as JSON -----------------------------------------------------------------------------

Json value_of(const ConfigNode& node) {
  if (node.kind == ConfigNode::Kind::list) {
    Json out = Json::array();
    for (const ConfigNode& item : node.children) out.push_back(value_of(item));
    return out;
  }
  const Json number = node.quoted ? Json() : Json::parse(node.text, nullptr, false);
  return number.is_null() || number.is_discarded() ? Json(node.text) : number;
}

Json sizes_json(const ConfigNode& sizes) {
  Json out = Json::object();
  for (const ConfigNode& entry : sizes.children) out[entry.key] = value_of(entry);
  return out;
}

Json to_json(const AnyConfig& config) { return sizes_json(write_config(config)); }

ConfigNode node_of(const Json& json, const std::string& where) {
  ConfigNode node;
  node.place = node.key_place = {where, 0, 0};
  node.kind = json.is_object()  ? ConfigNode::Kind::map
              : json.is_array() ? ConfigNode::Kind::list
                                : ConfigNode::Kind::scalar;
  if (json.is_object()) {
    for (const auto& [key, value] : json.items()) {
      node.children.push_back(node_of(value, where));
      node.children.back().key = key;
    }
  } else if (json.is_array()) {
    for (const Json& item : json) node.children.push_back(node_of(item, where));
  } else {
    node.quoted = json.is_string();
    node.text = json.is_string() ? json.get<std::string>() : json.dump();
  }
  return node;
}

/// The default sizes of the model, changed by the sizes in `json`.
AnyConfig sizes_of(const ModelType& type, const Json& json, const std::string& where) {
  AnyConfig out = type.config;
  read_config(node_of(json, where), out);
  return out;
}

Settings settings_of(const Json& json, const std::string& where) {
  Settings out;
  for (const auto& [key, value] : json.items()) {
    if (!value.is_string())
      throw InputError(where, "has a setting " + name_in_quotes(key) + " that is no text",
                       kGiveWeights);
    out[key] = value.get<std::string>();
  }
  return out;
}

Json object_at(const Json& json, const char* key, const std::string& where) {
  if (!json.contains(key)) return Json::object();
  if (!json[key].is_object())
    throw InputError(where, "has " + name_in_quotes(key) + " that are no section", kGiveWeights);
  return json[key];
}

// ---- metadata ----------------------------------------------------------------------------------

Json parse_metadata(const TensorFile& file, const std::string& where) {
  const auto text = file.metadata.find(kKey);
  if (text == file.metadata.end())
    throw InputError(where, "does not say which models it holds",
                     "bring it in with 'restage weights import'");
  if (text->second.size() > (1 << 16))
    throw InputError(where, "has too long metadata", kGiveWeights);
  const Json json = Json::parse(text->second, nullptr, false);
  const bool proper = json.is_object() && json.contains("format") && json["format"] == 1 &&
                      json.contains("models") && json["models"].is_object();
  if (!proper) throw InputError(where, "has metadata of an unknown format", kGiveWeights);
  return json;
}

/// Files of version 0.1.0 had the settings of all models in one place.
void add_older_settings(const Json& metadata, const std::string& where, Bundle* bundle) {
  static const std::map<std::string, std::string> roles = {
      {"translation", "motion"},
      {"remove_heading", "motion"},
      {"steady_heading", "motion"},
      {"keep_root_rotation", "deformation.offsets"}};
  for (const auto& [name, value] : settings_of(object_at(metadata, "extra", where), where)) {
    const auto role = roles.find(name);
    if (role == roles.end())
      throw InputError(where, "has a setting " + name_in_quotes(name) + " of no model",
                       kGiveWeights);
    const TrainedModel* found = bundle->find(role->second);
    if (found == nullptr) continue;
    TrainedModel model = *found;
    model.settings[name] = value;
    bundle->put(role->second, std::move(model));
  }
}

/// How many numbers the file has to fill a network: a network may only be about as large
/// (filled()).
int64_t numbers_below(const TensorFile& file, const std::string& prefix) {
  int64_t out = 0;
  for (const auto& [name, tensor] : file.tensors)
    if (name.starts_with(prefix)) out += tensor.numel();
  return out;
}

std::shared_ptr<Module> filled(const std::string& name, const AnyConfig& config,
                               const TensorFile& file, const std::string& prefix,
                               const std::string& where) {
  int64_t budget = 4 * numbers_below(file, prefix) + 4096;
  Init init;
  init.budget = &budget;
  std::shared_ptr<Module> net;
  try {
    net = make_model(name, config, init);
  } catch (const InputError&) {
    throw InputError(where,
                     "has sizes of " + name_in_quotes(name) + " that its tensors cannot fill",
                     kGiveWeights);
  }
  load_state(*net, file, prefix, where);
  return net;
}

bool known_model(const std::string& name) {
  return std::any_of(models().begin(), models().end(),
                     [&](const ModelType& type) { return type.name == name; });
}

/// A file names the module that defines its network, and nothing is run because a file says so.
[[noreturn]] void throw_not_imported(const std::string& model, const std::string& module,
                                     const std::string& where) {
  const bool file = module.ends_with(".py");
  throw InputError(where,
                   "needs the network " + name_in_quotes(model) + ", which the " +
                       (file ? "file " : "Python module ") + name_in_quotes(module) + " defines",
                   std::string("import that ") + (file ? "file" : "module") +
                       " first, or name it: 'python3 -m restage COMMAND ... --python " +
                       (file ? module : "FILE.py") + "'");
}

TrainedModel model_of(const std::string& place, const Json& entry, const TensorFile& file,
                      const std::string& where) {
  if (!entry.is_object() || !entry.contains("model") || !entry["model"].is_string())
    throw InputError(where, "does not name its model for " + name_in_quotes(place), kGiveWeights);
  TrainedModel out;
  out.model = entry["model"].get<std::string>();
  if (!known_model(out.model) && entry.contains("module") && entry["module"].is_string())
    throw_not_imported(out.model, entry["module"].get<std::string>(), where);
  if (!known_model(out.model) || !may_fill(model_type(out.model).role, role_of(place)))
    throw InputError(where,
                     "names " + name_in_quotes(out.model) + ", which is no model for " + place,
                     kGiveWeights);
  out.config = sizes_of(model_type(out.model), object_at(entry, "sizes", where), where);
  out.settings = settings_of(object_at(entry, "settings", where), where);
  out.net = filled(out.model, out.config, file, place + ".", where);
  return out;
}

}  // namespace

std::vector<std::string> with_late(std::vector<std::string> roles) {
  if (std::find(roles.begin(), roles.end(), "motion") != roles.end())
    roles.emplace_back(kLateMotion);
  return roles;
}

void move_networks(const Bundle& bundle, const std::vector<std::string>& roles, Device device) {
  for (const std::string& role : roles)
    if (const TrainedModel* model = bundle.find(role)) move_module(*model->net, device);
}

std::string prefix_of(const std::string& role) { return (role == "motion" ? "smrm" : role) + "."; }

std::string TrainedModel::setting(const std::string& name,
                                  const std::vector<std::string>& known) const {
  const auto found = settings.find(name);
  if (found == settings.end()) return known.front();
  if (std::find(known.begin(), known.end(), found->second) == known.end())
    throw InputError("",
                     "the weights were trained with " + name + " " + name_in_quotes(found->second) +
                         ", which is unknown here",
                     "use the version of restage that trained them");
  return found->second;
}

void Bundle::put(const std::string& role, TrainedModel model) {
  const ModelType& type = model_type(model.model);
  if (!may_fill(type.role, role))
    throw InputError("", "'" + model.model + "' cannot be used as " + role,
                     "it is a model for " + type.role);
  by_role_.insert_or_assign(role, std::move(model));
}

const TrainedModel* Bundle::find(const std::string& role) const {
  const auto found = by_role_.find(role);
  return found == by_role_.end() ? nullptr : &found->second;
}

const TrainedModel& Bundle::need(const std::string& role, const std::string& where) const {
  if (const TrainedModel* found = find(role)) return *found;
  const std::string held = joined(by_role_, [](const auto& entry) { return entry.first; });
  throw InputError(
      where,
      "holds no model for " + place_of(role) + (held.empty() ? "" : " (it holds " + held + ")"),
      "give weights that have one, or train that stage too");
}

void Bundle::add(const Bundle& other) {
  for (const auto& [role, model] : other) by_role_.insert_or_assign(role, model);
}

Bundle Bundle::only(const std::vector<std::string>& roles) const {
  Bundle out;
  for (const std::string& role : roles)
    if (const TrainedModel* found = find(role)) out.by_role_[role] = *found;
  return out;
}

JointDefinition joint_definition(const Bundle& bundle, const std::string& where) {
  std::vector<NamedDefinition> all;
  for (const auto& [role, model] : bundle)
    if (const auto said = model.settings.find(kJointsSetting); said != model.settings.end())
      all.push_back({checked_definition(said->second, where), where + " (" + role + ")"});
  return common_definition(all);
}

namespace {

/// A bundle's file, with the sizes of each model as `sizes` gives them. `code`: with the checksum
/// of a network's source, where it is written in Python.
TensorFile file_of(const Bundle& bundle, const std::function<ConfigNode(const AnyConfig&)>& sizes,
                   bool code = false) {
  TensorFile out;
  Json json = {{"format", 1}, {"models", Json::object()}};
  for (const auto& [role, model] : bundle) {
    append(&out, *model.net, prefix_of(role));
    json["models"][place_of(role)] = {{"model", model.model},
                                      {"sizes", sizes_json(sizes(model.config))},
                                      {"settings", model.settings}};
    const ModelType& type = model_type(model.model);
    Json& entry = json["models"][place_of(role)];
    if (!type.module.empty()) entry["module"] = type.module;
    if (code && !type.code.empty()) entry["code"] = type.code;
  }
  out.metadata[kKey] = json.dump();
  return out;
}

}  // namespace

TensorFile to_file(const Bundle& bundle) { return file_of(bundle, write_config<AnyConfig>); }

std::string identity_bytes(const Bundle& bundle) {
  Bundle plain;
  for (auto [role, model] : bundle) {
    model.settings.erase(kJointsSetting);
    plain.put(role, std::move(model));
  }
  return safetensors_bytes(file_of(plain, write_identity<AnyConfig>, true));
}

void save_bundle(const std::string& path, const Bundle& bundle) {
  write_safetensors(path, to_file(bundle));
}

Bundle bundle_of(const TensorFile& file, const std::string& where) {
  const Json json = parse_metadata(file, where);
  Bundle out;
  size_t tensors = 0;
  for (const auto& [place, entry] : json["models"].items()) {
    out.put(role_of(place), model_of(place, entry, file, where));
    for (const auto& item : file.tensors) tensors += item.first.starts_with(place + ".") ? 1 : 0;
  }
  if (tensors != file.tensors.size())
    throw InputError(where,
                     "holds " + std::to_string(file.tensors.size() - tensors) +
                         " tensors that belong to no model",
                     kGiveWeights);
  add_older_settings(json, where, &out);
  return out;
}

/// A name ("lite") is that of weights that come with the program, where neither a file nor a
/// run is called so.
std::string weights_path(const std::string& given) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  const std::string place = here_or_shipped(given);
  const bool folder = fs::is_directory(place, ignored);
  const std::string path = folder ? (fs::path(place) / "weights.safetensors").string() : place;
  if (fs::exists(path, ignored)) return path;
  if (const std::string ours = shipped("experiments/weights/" + given + ".safetensors");
      !ours.empty())
    return ours;
  if (folder)
    throw InputError(place, "holds no weights.safetensors",
                     "give a weights file, a finished run or an artifact");
  if (given.find_first_of("./") == std::string::npos)
    throw InputError(given, "is no file here, and no weights of this name come with the program",
                     "give a weights file, a finished run, standard or lite");
  return path;
}

Bundle load_bundle(const std::string& path) {
  const std::string file = weights_path(path);
  return bundle_of(read_safetensors(file), file);
}

TrainedModel import_model(const std::string& name, const std::vector<std::string>& sizes,
                          const TensorFile& state, const std::string& where) {
  TrainedModel out;
  out.model = name;
  const ModelType& type = model_type(name);
  const auto text = state.metadata.find(kKey);
  const Json json =
      text == state.metadata.end() ? Json() : Json::parse(text->second, nullptr, false);
  out.config = sizes_of(type, object_at(json, "sizes", where), where);
  out.settings = settings_of(object_at(json, "settings", where), where);
  ConfigNode tree = write_config(out.config);  // what the file says, then what the caller says
  for (const std::string& size : sizes) apply_override(tree, size);
  read_config(tree, out.config);
  out.net = filled(name, out.config, state, "", where);
  return out;
}

TensorFile export_model(const Bundle& bundle, const std::string& which, const std::string& where) {
  const TrainedModel* found = nullptr;
  for (const auto& [role, model] : bundle) {
    if (model.model != which && role != which && place_of(role) != which) continue;
    if (found != nullptr)
      throw InputError(where, "holds two models " + name_in_quotes(which), "name the role");
    found = &model;
  }
  if (found == nullptr)
    throw InputError(where, "holds no model " + name_in_quotes(which),
                     "see 'restage weights show' for what it holds");
  TensorFile out = to_file(*found->net, "");
  const Json json = {{"format", 1},
                     {"model", found->model},
                     {"sizes", to_json(found->config)},
                     {"settings", found->settings}};
  out.metadata[kKey] = json.dump();
  return out;
}

}  // namespace restage
