#include "nn/weights/bundle.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "nn/models/patch_transformer.h"
#include "nn/models/point_transformer.h"
#include "nn/models/pointnet.h"
#include "nn/weights/state.h"

namespace restage {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kKey = "restage";
constexpr const char* kFix = "give a weights file that restage wrote";
constexpr int64_t kMostPoints = 1 << 16;

/// The sizes by name, for both directions.
template <class Sizes, class F>
void each_size(Sizes& s, F f) {
  f("hidden", s.hidden);
  f("points", s.points);
  f("width", s.width);
  f("layers", s.layers);
  f("centres", s.centres);
  f("neighbours", s.neighbours);
  f("standardise", s.standardise);
  f("rest_pose_start", s.rest_pose_start);
  f("dropout", s.dropout);
}

/// Calls f(prefix, needed, model) for every place of a set.
template <class Set, class F>
void each_place(Set& set, const NeededModels& needs, F f) {
  f("skeleton.", needs.skeleton, set.skeleton);
  f("smrm.", needs.smrm, set.smrm);
  f("deformation.weights.", needs.deformation, set.weights);
  f("deformation.offsets.", false, set.offsets);
  f("deformation.root.", false, set.root);
  f("deformation.v1_field.", false, set.v1_field);
  f("discriminator.", false, set.discriminator);
}

std::string stage_of(const std::string& prefix) { return prefix.substr(0, prefix.size() - 1); }

/// Sizes as they are in the network, so that a file does not depend on what is the default later.
ModelSizes actual_sizes(ModelSizes s, const Module& net) {
  if (const auto* m = dynamic_cast<const PointTransformer*>(&net)) {
    s.points = m->config.points;
    s.width = m->config.width;
    s.layers = m->config.blocks;
    s.neighbours = m->config.neighbours;
  } else if (const auto* p = dynamic_cast<const PointNet*>(&net)) {
    s.points = p->config.points;
    s.dropout = p->config.dropout;
  } else if (const auto* t = dynamic_cast<const PatchTransformer*>(&net)) {
    s.points = t->config.points;
    s.width = t->config.width;
    s.layers = t->config.layers;
    s.centres = t->config.centres;
    s.neighbours = t->config.neighbours;
  } else if (const auto* r = dynamic_cast<const Smrm*>(&net)) {
    s.hidden = r->config.hidden;
    s.standardise = r->config.standardise;
    s.rest_pose_start = r->config.rest_pose_start;
    s.dropout = r->config.dropout;
  } else if (const auto* d = dynamic_cast<const Mlp3*>(&net)) {
    s.dropout = d->dropout_rate;
  }
  return s;
}

/// Only those that are set.
Json to_json(const ModelSizes& sizes) {
  Json out = Json::object();
  each_size(sizes, [&out](const char* name, const auto& value) {
    bool set = value > 0;
    if constexpr (std::is_same_v<std::decay_t<decltype(value)>, double>) set = value >= 0;
    if (set) out[name] = value;
  });
  return out;
}

ModelSizes sizes_of(const Json& json, const std::string& where) {
  ModelSizes out;
  each_size(out, [&](const char* name, auto& value) {
    if (!json.contains(name)) return;
    const Json& given = json[name];
    using T = std::decay_t<decltype(value)>;
    const bool fits = std::is_same_v<T, bool>     ? given.is_boolean()
                      : std::is_same_v<T, double> ? given.is_number()
                                                  : given.is_number_integer();
    if (!fits)
      throw InputError(where, "has no proper size " + name_in_quotes(name) + " in its metadata",
                       kFix);
    value = given.get<T>();
  });
  return out;
}

/// A network may only be as large as the numbers in the file that are to fill it; so a damaged size
/// cannot ask for all memory.
void check_sizes(const std::string& model, const ModelSizes& s, const TensorFile& file,
                 const std::string& prefix, const std::string& where) {
  int64_t numbers = 0;
  for (const auto& [name, tensor] : file.tensors)
    if (name.compare(0, prefix.size(), prefix) == 0) numbers += tensor.numel();
  const auto square_fits = [numbers](int64_t n) {
    return n <= 0 || (n < (int64_t{1} << 31) && n * n <= numbers);
  };
  // The point transformer doubles its channels (32 at first) with every layer.
  const bool doubles = model == "skeleton/point_transformer";
  const bool layers_fit =
      s.layers <= 0 || (doubles ? s.layers <= 16 && square_fits(int64_t{32} << s.layers)
                                : s.layers <= static_cast<int64_t>(file.tensors.size()));
  // ... and takes a quarter of the points.
  const bool points_fit =
      s.points <= kMostPoints && s.centres <= kMostPoints && s.neighbours <= kMostPoints &&
      (!doubles || s.points <= 0 || s.layers <= 0 || (s.points >> (2 * s.layers)) > 0);
  if (!square_fits(s.hidden) || !square_fits(s.width) || !layers_fit || !points_fit ||
      !(s.dropout < 1))
    throw InputError(
        where, "has sizes of " + name_in_quotes(model) + " that its tensors cannot fill", kFix);
}

template <class M>
std::unique_ptr<M> as(std::unique_ptr<Module> net) {
  auto* wanted = dynamic_cast<M*>(net.get());
  if (wanted == nullptr) return nullptr;
  net.release();
  return std::unique_ptr<M>(wanted);
}

Json parse_metadata(const TensorFile& file, const std::string& where) {
  const auto text = file.metadata.find(kKey);
  if (text == file.metadata.end())
    throw InputError(where, "does not say which models it holds",
                     "bring it in with 'restage weights import'");
  if (text->second.size() > (1 << 16)) throw InputError(where, "has too long metadata", kFix);
  const Json json = Json::parse(text->second, nullptr, false);
  const bool proper = json.is_object() && json.contains("format") && json["format"] == 1 &&
                      json.contains("models") && json["models"].is_object();
  if (!proper) throw InputError(where, "has metadata of an unknown format", kFix);
  return json;
}

}  // namespace

std::string stage_prefix(const std::string& model) {
  if (model.compare(0, 9, "skeleton/") == 0) return "skeleton.";
  if (model == "smrm/discriminator") return "discriminator.";
  if (model.compare(0, 5, "smrm/") == 0) return "smrm.";
  return "deformation." + model.substr(model.find('/') + 1) + ".";
}

void put_model(ModelSet* models, const std::string& name, const ModelSizes& sizes,
               std::unique_ptr<Module> net) {
  const std::string wanted = stage_prefix(name);
  each_place(*models, {}, [&](const std::string& prefix, bool, auto& place) {
    if (prefix != wanted) return;
    place.name = name;
    place.sizes = sizes;
    place.net = as<std::decay_t<decltype(*place.net)>>(std::move(net));
  });
}

TensorFile to_file(const ModelSet& models) {
  TensorFile out;
  Json json = {{"format", 1}, {"models", Json::object()}, {"extra", models.extra}};
  each_place(models, {}, [&](const std::string& prefix, bool, auto& place) {
    if (!place) return;
    append(&out, *place, prefix);
    json["models"][stage_of(prefix)] = {{"model", place.name},
                                        {"sizes", to_json(actual_sizes(place.sizes, *place))}};
  });
  out.metadata[kKey] = json.dump();
  return out;
}

void save_models(const std::string& path, const ModelSet& models) {
  write_safetensors(path, to_file(models));
}

ModelSet models_of(const TensorFile& file, const NeededModels& needs, const std::string& where) {
  const Json json = parse_metadata(file, where);
  ModelSet out;
  size_t tensors = 0;
  each_place(out, needs, [&](const std::string& prefix, bool needed, auto& place) {
    const std::string stage = stage_of(prefix);
    if (!json["models"].contains(stage)) {
      if (needed)
        throw InputError(where, "holds no model for " + stage, "give weights of all stages");
      return;
    }
    const Json& entry = json["models"][stage];
    if (!entry.is_object() || !entry.contains("model") || !entry["model"].is_string())
      throw InputError(where, "does not name its model for " + stage, kFix);
    const std::string name = entry["model"].get<std::string>();
    const ModelSizes sizes =
        sizes_of(entry.contains("sizes") ? entry["sizes"] : Json::object(), where);
    check_sizes(name, sizes, file, prefix, where);
    std::unique_ptr<Module> net;
    try {
      if (stage_prefix(name) == prefix) net = make_model(name, sizes, Init{});
    } catch (const InputError&) {
    }
    if (net == nullptr)
      throw InputError(where, "names " + name_in_quotes(name) + ", which is no model for " + stage,
                       kFix);
    load_state(*net, file, prefix, where);
    for (const auto& item : file.tensors)
      tensors += item.first.compare(0, prefix.size(), prefix) == 0 ? 1 : 0;
    place.name = name;
    place.sizes = sizes;
    place.net = as<std::decay_t<decltype(*place.net)>>(std::move(net));
  });
  if (tensors != file.tensors.size())
    throw InputError(where,
                     "holds " + std::to_string(file.tensors.size() - tensors) +
                         " tensors that belong to no model",
                     kFix);
  if (json.contains("extra") && json["extra"].is_object())
    for (const auto& [key, value] : json["extra"].items())
      if (value.is_string()) out.extra[key] = value.get<std::string>();
  return out;
}

ModelSet load_models(const std::string& path, const NeededModels& needs) {
  return models_of(read_safetensors(path), needs, path);
}

void import_model(ModelSet* models, const std::string& name, const ModelSizes& sizes,
                  const TensorFile& state, const std::string& where) {
  const bool known = std::any_of(::restage::models().begin(), ::restage::models().end(),
                                 [&](const ModelInfo& info) { return info.name == name; });
  if (known) check_sizes(name, sizes, state, "", where);
  auto net = make_model(name, sizes, Init{});
  load_state(*net, state, "", where);
  put_model(models, name, sizes, std::move(net));
}

TensorFile export_model(const ModelSet& models, const std::string& which,
                        const std::string& where) {
  TensorFile out;
  each_place(models, {}, [&](const std::string& prefix, bool, auto& place) {
    if (!place || (place.name != which && stage_of(prefix) != which)) return;
    out = to_file(*place, "");
    const Json json = {{"format", 1},
                       {"model", place.name},
                       {"sizes", to_json(actual_sizes(place.sizes, *place))}};
    out.metadata[kKey] = json.dump();
  });
  if (out.tensors.empty())
    throw InputError(where, "holds no model " + name_in_quotes(which),
                     "see 'restage weights show' for what it holds");
  return out;
}

ModelSizes exported_sizes(const TensorFile& state, const std::string& where) {
  const auto text = state.metadata.find(kKey);
  if (text == state.metadata.end()) return {};
  const Json json = Json::parse(text->second, nullptr, false);
  const bool has_sizes = json.is_object() && json.contains("sizes") && json["sizes"].is_object();
  return has_sizes ? sizes_of(json["sizes"], where) : ModelSizes{};
}

void set_size(ModelSizes* sizes, const std::string& name, const std::string& value) {
  const Json given = Json::parse(value, nullptr, false);
  bool known = false;
  std::string names;
  each_size(*sizes, [&](const char* candidate, auto&) {
    known = known || name == candidate;
    names += std::string(names.empty() ? "" : ", ") + candidate;
  });
  const double number = given.is_number() ? given.get<double>() : 0;  // below 1: the default
  const bool good = given.is_boolean() || (name == "dropout" ? number >= 0 : number >= 1);
  if (!known || !good)
    throw InputError("", "'" + name + "=" + value + "' is no size of a model",
                     "give NAME=NUMBER with one of " + names);
  Json all = to_json(*sizes);
  all[name] = given;
  *sizes = sizes_of(all, "--size");
}

}  // namespace restage
