#include "datasets/characters/gltf_document.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "autograd/base/atomic_file.h"
#include "autograd/base/base64.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/gltf/gltf_detail.h"
#include "datasets/readers/text/text.h"
#include "nn/geometry/glb_file.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kData = "data:application/octet-stream;base64,";

/// Runs what reads parts of the structure that read_gltf() does not look at. InputError if they are
/// of another kind than the format says.
template <class Work>
auto checked_kinds(const std::string& path, const Work& work) {
  try {
    return work();
  } catch (const Json::exception&) {
  } catch (const std::out_of_range&) {
  }
  gltf::broken(path, "has parts that are no glTF");
}

bool is_external(const Json& item) {
  return item.contains("uri") && !item["uri"].get_ref<const std::string&>().starts_with("data:");
}

/// What a picture's bytes are, by its name.
std::string mime_of(const std::string& uri) {
  if (text::ends_in(uri, {".jpg", ".jpeg"})) return "image/jpeg";
  if (text::ends_in(uri, {".webp"})) return "image/webp";
  if (text::ends_in(uri, {".ktx2"})) return "image/ktx2";
  return "image/png";
}

void pad(std::string& bytes) { bytes.resize((bytes.size() + 3) / 4 * 4, '\0'); }

}  // namespace

struct GltfDocument::State {
  std::string path;
  Json json;
  std::string binary;  ///< of a GLB: the bytes of buffer 0, without an address
  bool has_binary = false;
  std::string added;  ///< of a text: the bytes of the new animation

  /// A list of the document, which becomes an empty one where there is none.
  Json& list(const char* name) {
    Json& out = json[name];
    if (out.is_null()) out = Json::array();
    if (!out.is_array()) gltf::broken(path, cat("has ", name, " that are no list"));
    return out;
  }

  /// The files that the document names.
  std::vector<std::string> externals() const {
    return checked_kinds(path, [&] { return list_externals(); });
  }
  std::vector<std::string> list_externals() const {
    std::vector<std::string> out;
    for (const char* name : {"buffers", "images"})
      if (json.contains(name))
        for (const Json& item : json[name])
          if (is_external(item)) out.push_back(item["uri"].get<std::string>());
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
    return out;
  }

  /// Where in the new animation's buffer these bytes begin.
  static size_t put(std::string& bytes, const void* data, size_t size) {
    const size_t at = bytes.size();
    bytes.append(static_cast<const char*>(data), size);
    pad(bytes);
    return at;
  }

  Json as_binary(std::string* bytes) const;
  Json as_text() const;
};

GltfDocument::GltfDocument(std::string_view content, const std::string& path)
    : state_(std::make_unique<State>()) {
  state_->path = path;
  gltf::Chunks chunks{content, {}};
  if (content.starts_with("glTF")) chunks = gltf::split_glb(content, path);
  state_->json = Json::parse(chunks.json.begin(), chunks.json.end());
  const Json& json = state_->json;
  if (!chunks.binary.empty() && json.contains("buffers") && !json["buffers"].empty() &&
      !json["buffers"][0].contains("uri")) {
    state_->binary = chunks.binary.substr(0, json["buffers"][0]["byteLength"].get<size_t>());
    state_->has_binary = true;
  }
}

GltfDocument::~GltfDocument() = default;

void GltfDocument::append(const Clip& clip) {
  State& s = *state_;
  // The bytes lie behind those of buffer 0 if that is a GLB's own, else in a buffer of their own.
  if (s.has_binary) pad(s.binary);
  std::string& bytes = s.has_binary ? s.binary : s.added;
  const size_t begin = bytes.size();
  const size_t view = s.list("bufferViews").size();
  const auto accessor = [&](const void* data, size_t floats, const char* type, size_t count) {
    const size_t at = State::put(bytes, data, floats * sizeof(float));
    s.list("accessors")
        .push_back({{"bufferView", view},
                    {"byteOffset", at - begin},
                    {"componentType", 5126},
                    {"count", count},
                    {"type", type}});
    return s.json["accessors"].size() - 1;
  };
  std::vector<float> times(clip.frames);
  for (size_t f = 0; f < times.size(); ++f)
    times[f] = static_cast<float>(static_cast<double>(f) / clip.fps);
  for (const auto& [number, r] : clip.rest) {
    Json& node = s.json["nodes"][static_cast<size_t>(number)];
    if (node.erase("matrix") == 0) continue;
    node["translation"] = {r[0], r[1], r[2]};
    node["rotation"] = {r[3], r[4], r[5], r[6]};
    node["scale"] = {r[7], r[8], r[9]};
  }
  const size_t input = accessor(times.data(), times.size(), "SCALAR", times.size());
  s.json["accessors"][input]["min"] = {times.front()};
  s.json["accessors"][input]["max"] = {times.back()};
  Json channels = Json::array(), samplers = Json::array();
  const auto channel = [&](int node, const char* path, size_t output) {
    channels.push_back(
        {{"sampler", samplers.size()}, {"target", {{"node", node}, {"path", path}}}});
    samplers.push_back({{"input", input}, {"interpolation", "LINEAR"}, {"output", output}});
  };
  for (const auto& [node, places] : clip.moves)
    channel(node, "translation", accessor(places.data(), places.size(), "VEC3", clip.frames));
  for (const auto& [node, turns] : clip.turns)
    channel(node, "rotation", accessor(turns.data(), 4 * turns.size(), "VEC4", clip.frames));
  Json animation = {{"name", clip.name}, {"channels", channels}, {"samplers", samplers}};
  Json extras = {{"generator", "restage"}, {"fps", clip.fps}};
  if (!clip.confidence.empty()) extras["confidence"] = clip.confidence;
  if (!clip.filled.empty()) extras["filled"] = clip.filled;
  animation["extras"] = std::move(extras);
  s.list("animations").push_back(std::move(animation));
  const size_t buffer = s.has_binary ? 0 : s.list("buffers").size();
  s.list("bufferViews")
      .push_back({{"buffer", buffer},
                  {"byteOffset", s.has_binary ? begin : 0},
                  {"byteLength", bytes.size() - begin}});
  if (s.has_binary)
    s.json["buffers"][0]["byteLength"] = bytes.size();
  else
    s.list("buffers").push_back({{"byteLength", bytes.size()}});
}

void GltfDocument::keep_nodes_only() {
  State& s = *state_;
  Json out;
  for (const char* name : {"asset", "scene", "scenes", "nodes"})
    if (s.json.contains(name)) out[name] = s.json[name];
  for (Json& node : out["nodes"])
    for (const char* name : {"mesh", "skin", "camera", "weights", "extensions"}) node.erase(name);
  if (out.contains("scenes"))
    for (Json& scene : out["scenes"]) scene.erase("extensions");
  s.json = std::move(out);
  s.binary.clear();
  s.has_binary = false;
}

void GltfDocument::check_place(const std::string& out) const {
  if (!text::ends_in(out, {".gltf"})) return;
  const fs::path from = fs::absolute(state_->path).parent_path();
  const fs::path to = fs::absolute(out).parent_path();
  std::error_code error;
  if (fs::equivalent(from, to, error)) return;
  for (const std::string& uri : state_->externals()) {
    const std::string content = gltf::read_neighbour(uri, state_->path);  // refuses other folders
    const std::string file = (to / gltf::decode_percent(uri)).string();
    if (is_there(file) && read_file(file) != content)
      throw InputError(file, "is another file than the one of this name beside the target",
                       "write into another folder, or end {out} in .glb");
  }
}

/// Everything in one binary chunk; `bytes` gets it.
Json GltfDocument::State::as_binary(std::string* bytes) const {
  Json out = json;
  *bytes = binary;
  if (!out.contains("buffers")) return out;
  std::vector<size_t> begin;
  for (size_t b = 0; b < out["buffers"].size(); ++b) {
    const Json& item = out["buffers"][b];
    const size_t length = item["byteLength"].get<size_t>();
    pad(*bytes);
    begin.push_back(b == 0 && has_binary ? 0 : bytes->size());
    if (b == 0 && has_binary) continue;
    std::string own = added;
    if (item.contains("uri"))
      own = is_external(item) ? gltf::read_neighbour(item["uri"], path)
                              : gltf::decode_data_uri(item["uri"], length, path);
    *bytes += own.substr(0, length);
  }
  pad(*bytes);
  const auto move = [&](Json& view) {
    const size_t b = view["buffer"].get<size_t>();
    if (begin.at(b) > 0) view["byteOffset"] = view.value("byteOffset", size_t{0}) + begin[b];
    view["buffer"] = 0;
  };
  if (out.contains("bufferViews"))
    for (Json& view : out["bufferViews"]) {
      move(view);
      if (view.contains("extensions"))  // the same data compressed, beside the plain one
        for (Json& extension : view["extensions"])
          if (extension.contains("buffer")) move(extension);
    }
  if (out.contains("images"))
    for (Json& image : out["images"]) {
      if (!is_external(image)) continue;
      const std::string uri = image["uri"];
      const std::string picture = gltf::read_neighbour(uri, path);
      const size_t at = put(*bytes, picture.data(), picture.size());
      if (!out.contains("bufferViews")) out["bufferViews"] = Json::array();
      out["bufferViews"].push_back(
          {{"buffer", 0}, {"byteOffset", at}, {"byteLength", picture.size()}});
      image.erase("uri");
      image["bufferView"] = out["bufferViews"].size() - 1;
      if (!image.contains("mimeType")) image["mimeType"] = mime_of(uri);
    }
  out["buffers"] = Json::array();
  if (!bytes->empty()) out["buffers"].push_back({{"byteLength", bytes->size()}});
  if (out["buffers"].empty()) out.erase("buffers");
  return out;
}

Json GltfDocument::State::as_text() const {
  Json out = json;
  if (!out.contains("buffers")) return out;
  for (size_t b = 0; b < out["buffers"].size(); ++b) {
    Json& item = out["buffers"][b];
    if (item.contains("uri")) continue;
    const std::string& own = b == 0 && has_binary ? binary : added;
    item["uri"] = kData + base64(own.data(), own.size());
  }
  return out;
}

void GltfDocument::write(const std::string& out) const {
  const State& s = *state_;
  if (text::ends_in(out, {".gltf"})) {
    check_place(out);
    const fs::path from = fs::absolute(s.path).parent_path(), to = fs::absolute(out).parent_path();
    std::error_code error;
    if (!fs::equivalent(from, to, error))
      for (const std::string& uri : s.externals()) {
        const fs::path file = to / gltf::decode_percent(uri);
        fs::create_directories(file.parent_path(), error);
        if (!is_there(file.string()))
          write_file_atomically(file.string(), gltf::read_neighbour(uri, s.path));
      }
    write_file_atomically(out, checked_kinds(s.path, [&] { return s.as_text().dump(1) + "\n"; }));
    return;
  }
  std::string bytes;
  const std::string text = checked_kinds(s.path, [&] { return s.as_binary(&bytes).dump(); });
  write_file_atomically(out, glb_bytes(text, std::move(bytes), out));
}

}  // namespace restage
