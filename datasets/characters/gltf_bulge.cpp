// Morph targets that a document gets, and their weights.
#include <algorithm>
#include <cmath>
#include <limits>

#include "datasets/characters/gltf_document_detail.h"

namespace restage {
namespace {

using gltf_document::Json;

constexpr int kBytes = 5120, kShorts = 5122, kFloats = 5126, kVertexView = 34962;
constexpr const char* kQuantised = "KHR_mesh_quantization";

std::vector<float> weights_in(const Json& holder) {
  std::vector<float> out;
  if (holder.contains("weights"))
    for (const Json& w : holder["weights"]) out.push_back(w.get<float>());
  return out;
}

void require(Json& root, const char* list) {
  Json& names = root[list];
  if (names.is_null()) names = Json::array();
  if (std::find(names.begin(), names.end(), kQuantised) == names.end()) names.push_back(kQuantised);
}

/// Of a number of the accessor.
size_t bytes_of(const Json& accessor) {
  const int kind = accessor.at("componentType").get<int>();
  return kind == kFloats ? 4 : kind == kBytes || kind == kBytes + 1 ? 1 : 2;
}

double rounded(double millimetres) { return std::round(millimetres * 1e3) / 1e3; }

}  // namespace

GltfDocument::Bulger::Bulger(State& state, const Bulge& bulge, size_t buffer,
                             std::vector<int32_t> vertex)
    : s_(state), bulge_(bulge), buffer_(buffer), vertex_(std::move(vertex)) {
  for (const Point& p : bulge_.mean) largest_ = std::max(largest_, p.cwiseAbs().maxCoeff());
  for (const Point& p : bulge_.mean)
    for (const float x : p)
      mean_.push_back(static_cast<int16_t>(largest_ > 0 ? std::lround(32767 * x / largest_) : 0));
  require(s_.json, "extensionsUsed");
  require(s_.json, "extensionsRequired");
}

size_t GltfDocument::Bulger::add(const std::string& bytes, Json accessor, int stride) {
  std::string& all = s_.has_binary ? s_.binary : s_.added;
  gltf_document::pad(all);
  const size_t at = State::put(all, bytes.data(), bytes.size());
  Json view = {{"buffer", buffer_}, {"byteOffset", at}, {"byteLength", bytes.size()}};
  if (stride > 0) view["byteStride"] = stride, view["target"] = kVertexView;
  s_.list("bufferViews").push_back(std::move(view));
  accessor["bufferView"] = s_.json["bufferViews"].size() - 1;
  s_.list("accessors").push_back(std::move(accessor));
  return s_.json["accessors"].size() - 1;
}

template <class T>
size_t GltfDocument::Bulger::target(const GltfPart& part, int kind, const std::vector<T>& numbers) {
  std::array<int, 3> low, high;
  low.fill(std::numeric_limits<T>::max());
  high.fill(-std::numeric_limits<T>::max());
  std::string bytes;
  for (size_t i = part.first; i < part.first + part.count; ++i) {
    const size_t v = vertex_.empty() ? i : static_cast<size_t>(vertex_.at(i));
    std::array<T, 4> row{};  // of four numbers each, as the format wants
    for (size_t axis = 0; axis < 3; ++axis) {
      row[axis] = numbers.at(3 * v + axis);
      low[axis] = std::min<int>(low[axis], row[axis]);
      high[axis] = std::max<int>(high[axis], row[axis]);
    }
    bytes.append(reinterpret_cast<const char*>(row.data()), sizeof row);
  }
  return add(bytes,
             {{"componentType", kind},
              {"normalized", true},
              {"count", part.count},
              {"type", "VEC3"},
              {"min", low},
              {"max", high}},
             4 * sizeof(T));
}

/// A target that moves nothing, for a primitive that is no surface of ours.
size_t GltfDocument::Bulger::nothing(size_t count) {
  s_.list("accessors")
      .push_back({{"componentType", kFloats},
                  {"count", count},
                  {"type", "VEC3"},
                  {"min", {0, 0, 0}},
                  {"max", {0, 0, 0}}});
  return s_.json["accessors"].size() - 1;
}

void GltfDocument::Bulger::name_targets(Json& mesh, size_t before) {
  Json& extras = mesh["extras"];
  if (!extras.is_null() && !extras.is_object()) extras = {{"before", extras}};
  Json& names = extras["targetNames"];
  if (!names.is_array() || names.size() != before) {
    names = Json::array();
    for (size_t k = 0; k < before; ++k) names.push_back("target_" + std::to_string(k));
  }
  names.push_back("surface_mean");
  for (size_t k = 0; k < bulge_.deltas.size(); ++k)
    names.push_back("surface_" + std::to_string(k + 1));
}

void GltfDocument::Bulger::add(size_t node, size_t mesh, const std::vector<GltfPart>& parts) {
  Json& primitives = s_.json["meshes"].at(mesh).at("primitives");
  const size_t before =
      primitives.at(0).contains("targets") ? primitives.at(0)["targets"].size() : 0;
  for (size_t p = 0; p < primitives.size(); ++p) {
    const auto part = std::find_if(parts.begin(), parts.end(),
                                   [&](const GltfPart& some) { return some.primitive == p; });
    std::vector<size_t> added;
    if (part == parts.end()) {
      const auto place = primitives[p].at("attributes").at("POSITION").get<size_t>();
      const size_t none = nothing(s_.json["accessors"].at(place).at("count").get<size_t>());
      added.assign(bulge_.deltas.size() + 1, none);
    } else {
      added.push_back(target(*part, kShorts, mean_));
      for (const auto& delta : bulge_.deltas) added.push_back(target(*part, kBytes, delta));
    }
    Json& targets = s_.json["meshes"][mesh]["primitives"][p]["targets"];
    if (targets.is_null()) targets = Json::array();
    for (const size_t accessor : added) targets.push_back({{"POSITION", accessor}});
  }
  Json& shown = s_.json["nodes"].at(node);
  Json& changed = s_.json["meshes"][mesh];
  Wearer wearer{node, weights_in(shown.contains("weights") ? shown : changed)};
  wearer.before.resize(before);
  std::vector<float> rest = wearer.before;
  rest.resize(before + 1 + bulge_.deltas.size());  // at rest the meshes are as they were
  changed["weights"] = rest;
  if (shown.contains("weights")) shown["weights"] = rest;
  name_targets(changed, before);
  Json& animations = s_.list("animations");
  for (size_t a = 0; before > 0 && a < animations.size(); ++a) widen(wearer, animations[a]);
  wearers_.push_back(std::move(wearer));
}

/// An animation that was there says nothing of the new targets, and has to say so.
void GltfDocument::Bulger::widen(const Wearer& wearer, Json& animation) {
  const size_t before = wearer.before.size();
  for (const Json& channel : animation.at("channels")) {
    const Json& target = channel.at("target");
    if (target.value("path", "") != "weights" || target.value("node", size_t{0}) != wearer.node)
      continue;
    const auto number = channel.at("sampler").get<size_t>();
    const Json old =
        s_.json["accessors"].at(animation["samplers"].at(number).at("output").get<size_t>());
    const Json view = s_.json["bufferViews"].at(old.at("bufferView").get<size_t>());
    const size_t count = old.at("count").get<size_t>(), size = bytes_of(old);
    const std::string all = s_.buffer(view.at("buffer").get<size_t>());
    const size_t at = view.value("byteOffset", size_t{0}) + old.value("byteOffset", size_t{0});
    if (at + size * count > all.size()) gltf::broken(s_.path, "has weights behind its end");
    std::string wide;
    for (size_t from = 0; from + before <= count; from += before)
      wide.append(all, at + size * from, size * before)
          .append(size * (1 + bulge_.deltas.size()), '\0');
    Json accessor = {{"componentType", old.at("componentType")},
                     {"count", wide.size() / size},
                     {"type", "SCALAR"}};
    if (old.contains("normalized")) accessor["normalized"] = old["normalized"];
    animation["samplers"][number]["output"] = add(wide, std::move(accessor), 0);
  }
}

/// As whole numbers where all are from -1 to 1.
size_t GltfDocument::Bulger::weights_of(const Wearer& wearer) {
  const size_t targets = bulge_.deltas.size(), frames = bulge_.distance.size();
  std::vector<float> all;
  for (size_t f = 0; f < frames; ++f) {
    all.insert(all.end(), wearer.before.begin(), wearer.before.end());
    all.push_back(largest_);
    for (size_t k = 0; k < targets; ++k) all.push_back(bulge_.weights[f * targets + k]);
  }
  const bool whole = std::all_of(all.begin(), all.end(), [](float w) { return std::abs(w) <= 1; });
  Json accessor = {
      {"componentType", whole ? kShorts : kFloats}, {"count", all.size()}, {"type", "SCALAR"}};
  if (!whole)
    return add(std::string(reinterpret_cast<const char*>(all.data()), 4 * all.size()),
               std::move(accessor), 0);
  accessor["normalized"] = true;
  std::vector<int16_t> steps;
  for (const float w : all) steps.push_back(static_cast<int16_t>(std::lround(32767 * w)));
  return add(std::string(reinterpret_cast<const char*>(steps.data()), 2 * steps.size()),
             std::move(accessor), 0);
}

void GltfDocument::Bulger::end() {
  Json& animations = s_.list("animations");
  if (animations.empty() || bulge_.distance.empty()) return;
  for (const Wearer& wearer : wearers_) {
    const size_t output = weights_of(wearer);
    Json& animation = s_.json["animations"].back();
    const Json input = animation["samplers"].at(0).at("input");
    animation["channels"].push_back({{"sampler", animation["samplers"].size()},
                                     {"target", {{"node", wearer.node}, {"path", "weights"}}}});
    animation["samplers"].push_back(
        {{"input", input}, {"interpolation", "LINEAR"}, {"output", output}});
  }
  Json& distances = s_.json["animations"].back()["extras"]["distance_mm"] = Json::array();
  for (const double d : bulge_.distance)
    distances.push_back(d < 0 ? Json(nullptr) : Json(std::round(d * 1e2) / 1e2));
  s_.json["asset"]["extras"]["surface_error_mm"] = {{"mean", rounded(bulge_.mean_error)},
                                                    {"p95", rounded(bulge_.p95_error)},
                                                    {"max", rounded(bulge_.max_error)}};
}

}  // namespace restage
