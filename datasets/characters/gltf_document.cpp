#include "datasets/characters/gltf_document.h"

#include <algorithm>
#include <cstring>

#include "autograd/base/atomic_file.h"
#include "autograd/base/base64.h"
#include "datasets/characters/gltf_document_detail.h"
#include "datasets/readers/text/text.h"
#include "nn/geometry/glb_file.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
using gltf_document::checked_kinds;
using gltf_document::is_external;
using gltf_document::pad;
using Json = gltf_document::Json;

constexpr const char* kData = "data:application/octet-stream;base64,";

/// What a picture's bytes are, by its name.
std::string mime_of(const std::string& uri) {
  if (text::ends_in(uri, {".jpg", ".jpeg"})) return "image/jpeg";
  if (text::ends_in(uri, {".webp"})) return "image/webp";
  if (text::ends_in(uri, {".ktx2"})) return "image/ktx2";
  return "image/png";
}

}  // namespace

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

namespace {

bool stands_still(const GltfNode& node) {
  return node.parent < 0 && node.translation.isZero(0) && node.scale == Vec3::Ones() &&
         node.rotation.coeffs() == Quat::Identity().coeffs();
}

}  // namespace

/// What GlbWriter made: its document, and the bytes of its accessors.
struct GltfDocument::Worn {
  Json json;
  std::string binary;

  Worn(const std::string& glb, const std::string& path) {
    gltf::Chunks chunks = gltf::split_glb(glb, path);
    json = Json::parse(chunks.json.begin(), chunks.json.end());
    binary = std::string(chunks.binary);
  }
  std::string_view bytes(size_t accessor) const {
    const Json& view = json["bufferViews"][json["accessors"][accessor]["bufferView"].get<size_t>()];
    return std::string_view(binary).substr(view["byteOffset"].get<size_t>(),
                                           view["byteLength"].get<size_t>());
  }
};

/// Puts parts of another document into this one.
class GltfDocument::Tailor {
 public:
  Tailor(State& state, const Worn& worn, const Gltf& file, const JointMoves* unposed,
         const std::vector<int32_t>& vertex, const Bulge* bulge)
      : s_(state),
        worn_(worn),
        file_(file),
        rest_(gltf_rest(file)),
        unposed_(unposed),
        vertex_(vertex) {
    if (s_.has_binary) pad(s_.binary);
    buffer_ = s_.has_binary ? 0 : s_.list("buffers").size();
    if (bulge != nullptr) bulger_.emplace(state, *bulge, buffer_, vertex);
    first_node_ = s_.list("nodes").size();
  }

  void sew() {
    add_bones();
    std::map<int, std::vector<GltfPart>> of_node;
    for (const GltfPart& part : file_.parts) of_node[part.node].push_back(part);
    std::map<size_t, int> wearers;  // of a mesh
    for (const auto& [node, parts] : of_node) dress(node, parts, wearers);
    add_animation();
    if (bulger_) bulger_->end();
    Json& extras = s_.json["asset"]["extras"];
    if (!extras.is_null() && !extras.is_object()) extras = {{"before", extras}};
    for (const auto& [key, value] : worn_.json["asset"]["extras"].items()) extras[key] = value;
    if (s_.has_binary)
      s_.json["buffers"][0]["byteLength"] = s_.binary.size();
    else
      s_.list("buffers").push_back({{"byteLength", s_.added.size()}});
  }

 private:
  /// A view of its own, since the format wants one for each attribute of vertices.
  size_t add(std::string_view bytes, Json accessor, int target) {
    std::string& all = s_.has_binary ? s_.binary : s_.added;
    const size_t at = State::put(all, bytes.data(), bytes.size());
    Json view = {{"buffer", buffer_}, {"byteOffset", at}, {"byteLength", bytes.size()}};
    if (target != 0) view["target"] = target;
    s_.list("bufferViews").push_back(view);
    accessor["bufferView"] = s_.json["bufferViews"].size() - 1;
    s_.list("accessors").push_back(std::move(accessor));
    return s_.json["accessors"].size() - 1;
  }
  size_t copy(size_t accessor) {
    return add(worn_.bytes(accessor), worn_.json["accessors"][accessor], 0);
  }
  /// Some rows of an attribute.
  size_t rows(size_t accessor, size_t first, size_t count) {
    constexpr int kVertices = 34962;
    const std::string_view all = worn_.bytes(accessor);
    Json one = worn_.json["accessors"][accessor];
    const size_t width = all.size() / one["count"].get<size_t>();
    one["count"] = count;
    if (vertex_.empty())
      return add(all.substr(first * width, count * width), std::move(one), kVertices);
    std::string some;
    for (size_t v = first; v < first + count; ++v)
      some += all.substr(static_cast<size_t>(vertex_.at(v)) * width, width);
    return add(some, std::move(one), kVertices);
  }

  Json& scene() {
    if (s_.list("scenes").empty()) gltf::broken(s_.path, "has no scene");
    return s_.json["scenes"].at(s_.json.value("scene", size_t{0}));
  }

  void add_bones() {
    const Json& nodes = worn_.json["nodes"];
    for (size_t n = 0; n + 1 < nodes.size(); ++n) {  // the last is the mesh's
      Json node = nodes[n];
      if (node.contains("children"))
        for (Json& child : node["children"]) child = child.get<size_t>() + first_node_;
      s_.json["nodes"].push_back(std::move(node));
    }
    scene()["nodes"].push_back(worn_.json["skins"][0]["skeleton"].get<size_t>() + first_node_);
  }

  /// The skin of a node: bones, seen from the space in which its vertices are stored.
  size_t skin_of(const GltfNode& node, size_t place) {
    if (stands_still(node) && plain_skin_) return *plain_skin_;
    Json skin = worn_.json["skins"][0];
    const size_t accessor = skin["inverseBindMatrices"].get<size_t>();
    std::string bytes(worn_.bytes(accessor));
    for (size_t at = 0; at < bytes.size(); at += 64) {
      Eigen::Matrix4f m;
      std::memcpy(m.data(), &bytes[at], 64);
      Eigen::Matrix4d all = m.cast<double>();
      if (const size_t j = at / 64; unposed_ != nullptr && j < kJoints)
        all *= (*unposed_)[j].matrix();
      m = (all * rest_[place].matrix()).cast<float>();
      m.row(3) << 0, 0, 0, 1;
      std::memcpy(&bytes[at], m.data(), 64);
    }
    skin["inverseBindMatrices"] = add(bytes, worn_.json["accessors"][accessor], 0);
    skin["skeleton"] = skin["skeleton"].get<size_t>() + first_node_;
    for (Json& joint : skin["joints"]) joint = joint.get<size_t>() + first_node_;
    s_.list("skins").push_back(std::move(skin));
    const size_t out = s_.json["skins"].size() - 1;
    if (stands_still(node)) plain_skin_ = out;
    return out;
  }

  void dress(int number, const std::vector<GltfPart>& parts, std::map<size_t, int>& wearers) {
    const auto place = static_cast<size_t>(
        std::find_if(file_.nodes.begin(), file_.nodes.end(),
                     [&](const GltfNode& node) { return node.number == number; }) -
        file_.nodes.begin());
    auto mesh = s_.json["nodes"].at(static_cast<size_t>(number)).at("mesh").get<size_t>();
    if (wearers[mesh]++ > 0) {  // shown twice: each has weights of its own
      s_.json["meshes"].push_back(Json(s_.json["meshes"].at(mesh)));
      mesh = s_.json["meshes"].size() - 1;
    }
    const Json& ours = worn_.json["meshes"][0]["primitives"][0]["attributes"];
    for (const GltfPart& part : parts) {
      Json& attributes =
          s_.json["meshes"].at(mesh).at("primitives").at(part.primitive)["attributes"];
      for (int set = 1; attributes.erase(cat("JOINTS_", set)) > 0; ++set)  // of a skin that is gone
        attributes.erase(cat("WEIGHTS_", set));
      for (const char* name : {"JOINTS_0", "WEIGHTS_0"})
        attributes[name] = rows(ours[name].get<size_t>(), part.first, part.count);
    }
    const size_t skin = skin_of(file_.nodes[place], place);
    size_t wearer = static_cast<size_t>(number);
    if (!stands_still(file_.nodes[place])) wearer = own_node(wearer);
    s_.json["nodes"][wearer]["mesh"] = mesh;
    s_.json["nodes"][wearer]["skin"] = skin;
    if (bulger_) bulger_->add(wearer, mesh, parts);
  }

  /// A node at the top of the scene that shows what `number` showed.
  size_t own_node(size_t number) {
    Json node = Json::object();
    const size_t out = s_.json["nodes"].size();
    Json& from = s_.json["nodes"][number];
    if (from.contains("name")) node["name"] = from["name"];
    from.erase("mesh");
    if (from.contains("weights")) node["weights"] = from["weights"], from.erase("weights");
    s_.json["nodes"].push_back(std::move(node));
    scene()["nodes"].push_back(out);
    for (Json& animation : s_.list("animations"))
      for (Json& channel : animation["channels"])
        if (Json& target = channel["target"];
            target.value("path", "") == "weights" && target.value("node", size_t{0}) == number)
          target["node"] = out;
    if (s_.json["animations"].empty()) s_.json.erase("animations");
    return out;
  }

  void add_animation() {
    if (!worn_.json.contains("animations")) return;
    Json animation = worn_.json["animations"][0];
    std::map<size_t, size_t> copied;
    for (Json& sampler : animation["samplers"])
      for (const char* end : {"input", "output"}) {
        const auto accessor = sampler[end].get<size_t>();
        if (copied.count(accessor) == 0) copied[accessor] = copy(accessor);
        sampler[end] = copied[accessor];
      }
    for (Json& channel : animation["channels"])
      channel["target"]["node"] = channel["target"]["node"].get<size_t>() + first_node_;
    s_.list("animations").push_back(std::move(animation));
  }

  State& s_;
  const Worn& worn_;
  const Gltf& file_;
  const GltfTransforms rest_;
  const JointMoves* unposed_;
  const std::vector<int32_t>& vertex_;
  size_t buffer_ = 0, first_node_ = 0;
  std::optional<size_t> plain_skin_;
  std::optional<Bulger> bulger_;
};

void GltfDocument::wear(const std::string& glb, const Gltf& file, const JointMoves* unposed,
                        const std::vector<int32_t>& vertex, const Bulge* bulge) {
  checked_kinds(state_->path, [&] {
    Tailor(*state_, Worn(glb, state_->path), file, unposed, vertex, bulge).sew();
  });
}

void GltfDocument::bulge(const Bulge& bulge, const Gltf& file) {
  State& s = *state_;
  checked_kinds(s.path, [&] {
    std::map<int, std::vector<GltfPart>> of_node;
    for (const GltfPart& part : file.parts) of_node[part.node].push_back(part);
    const size_t buffer = s.has_binary ? 0 : s.list("buffers").size() - 1;
    Bulger bulger(s, bulge, buffer, {});
    std::map<size_t, int> wearers;
    for (const auto& [node, parts] : of_node) {
      Json& shown = s.json["nodes"].at(static_cast<size_t>(node));
      auto mesh = shown.at("mesh").get<size_t>();
      if (wearers[mesh]++ > 0) {  // shown twice: each bulges in its own way
        s.json["meshes"].push_back(Json(s.json["meshes"].at(mesh)));
        shown["mesh"] = mesh = s.json["meshes"].size() - 1;
      }
      bulger.add(static_cast<size_t>(node), mesh, parts);
    }
    bulger.end();
    s.json["buffers"][buffer]["byteLength"] = (s.has_binary ? s.binary : s.added).size();
  });
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

std::string GltfDocument::State::buffer(size_t number) const {
  const Json& item = json["buffers"][number];
  if (!item.contains("uri")) return number == 0 && has_binary ? binary : added;
  if (is_external(item)) return gltf::read_neighbour(item["uri"], path);
  return gltf::decode_data_uri(item["uri"], item["byteLength"].get<size_t>(), path);
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
    *bytes += buffer(b).substr(0, length);
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
