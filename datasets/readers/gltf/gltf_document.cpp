// From bytes to tinygltf's structures. What tinygltf would believe is looked at first: it is given
// a text that holds only what is used, of limited depth and number of values, and no buffers.
#include <algorithm>
#include <cctype>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>

#include "autograd/base/atomic_file.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/foreign_kinds.h"
#include "datasets/readers/gltf/gltf_detail.h"
#include "datasets/readers/text/text.h"

namespace restage::gltf {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

constexpr int kDepth = 64;
// Bytes that tinygltf and the JSON library take for an object (a node has 456, vectors grow by
// doubling) and for any other value.
constexpr uint64_t kObjectCost = 1600, kValueCost = 128;
constexpr const char* kUsed[] = {"asset",         "scene",     "scenes",     "nodes",
                                 "meshes",        "accessors", "skins",      "bufferViews",
                                 "animations",    "buffers",   "extensions", "extensionsRequired",
                                 "extensionsUsed"};
constexpr const char* kLooks[] = {"materials", "textures", "images", "samplers"};

/// Extensions that leave positions, skins and animations as they are.
bool harmless(const std::string& extension) {
  static constexpr const char* kKnown[] = {
      "KHR_mesh_quantization", "KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_",
      "MSFT_texture_",         "EXT_lights_",    "KHR_xmp",      "VRM"};
  for (const char* known : kKnown)
    if (extension.starts_with(known)) return true;
  return false;
}

/// How it stores data that only this extension can unpack; empty: in no such way.
std::string compression_of(const std::string& extension) {
  if (extension == "KHR_draco_mesh_compression") return "Draco";
  return extension.find("meshopt") != std::string::npos ? "meshopt" : "";
}

std::vector<std::string> extensions_in(const Json& root, const char* list) {
  std::vector<std::string> out;
  if (root.contains(list) && root[list].is_array())
    for (const Json& name : root[list])
      if (name.is_string()) out.push_back(name.get<std::string>());
  return out;
}

void check_extensions(const Json& root, const std::string& path) {
  for (const std::string& name : extensions_in(root, "extensionsRequired")) {
    if (harmless(name)) continue;
    if (!compression_of(name).empty()) refuse_compression(name, path);
    throw InputError(path,
                     "needs the glTF extension " + text::quote(name) + ", which is not known here",
                     "export it without that extension");
  }
}

// ---- container ---------------------------------------------------------------------------------

uint32_t word(std::string_view content, size_t at) {
  uint32_t value;
  std::memcpy(&value, content.data() + at, 4);
  return value;
}

// ---- structure ---------------------------------------------------------------------------------

bool is_one_of(const std::string& key, std::span<const char* const> names) {
  return std::find(names.begin(), names.end(), key) != names.end();
}

/// Parses only what is used, in bounded memory. `looks`: also what only looks are made of.
Json parse_json(std::string_view text, uint64_t payload, const std::string& path, bool looks) {
  uint64_t left = (uint64_t{64} << 20) + 8 * payload;
  const auto keep = [&](int depth, Json::parse_event_t event, Json& parsed) {
    if (depth > kDepth) broken(path, "is nested deeper than any glTF file");
    if (event == Json::parse_event_t::key) {
      const std::string& key = parsed.get_ref<const std::string&>();
      if (depth == 1) return is_one_of(key, kUsed) || (looks && is_one_of(key, kLooks));
      return looks || key != "extras";
    }
    const uint64_t cost = event == Json::parse_event_t::object_start ? kObjectCost : kValueCost;
    if (cost > left) broken(path, "has far more parts than data");
    left -= cost;
    return true;
  };
  if (text.empty()) broken(path, "is empty");
  try {
    Json root = Json::parse(text.begin(), text.end(), keep);
    if (!root.is_object()) broken(path, "is no glTF file");
    return root;
  } catch (const Json::parse_error& error) {
    broken(path, cat("is not valid JSON at byte ", error.byte, " of its structure"));
  } catch (const Json::exception&) {
    broken(path, "is not valid JSON");
  }
}

/// Drops "extensions" and "extras" everywhere; their number is bounded by parse_json(), their depth
/// too.
void drop_extensions(Json& value) {
  if (value.is_object()) value.erase("extensions");
  if (value.is_object()) value.erase("extras");
  if (value.is_structured())
    for (Json& part : value) drop_extensions(part);
}

/// Who made the animation, if it says so.
bool is_ours(const Json& animation) {
  const auto at = Json::json_pointer("/extras/generator");
  return animation.is_object() && animation.contains(at) && animation.at(at) == "restage";
}

/// Takes what looks are made of out of the structure, as text.
std::string take_looks(Json& root) {
  Json out = Json::object();
  for (const char* name : kLooks)
    if (const auto at = root.find(name); at != root.end()) {
      out[name] = std::move(*at);
      root.erase(at);
    }
  out["ours"] = Json::array();
  if (const auto list = root.find("animations"); list != root.end() && list->is_array())
    for (const Json& animation : *list) out["ours"].push_back(is_ours(animation));
  return out.dump(-1, ' ', false, Json::error_handler_t::replace);
}

int node_number(const Json& bone) {
  const auto at = bone.is_object() ? bone.find("node") : bone.end();
  return bone.is_object() && at != bone.end() && at->is_number_unsigned() &&
                 at->get<uint64_t>() < uint64_t{1} << 31
             ? at->get<int>()
             : -1;
}

/// VRM 0: extensions.VRM.humanoid.humanBones is a list; VRM 1 and VRM animations: an object.
std::vector<std::pair<std::string, int>> read_humanoid(const Json& root, std::string* standard) {
  std::vector<std::pair<std::string, int>> out;
  for (const auto& [name, title_of_it] : {std::pair{"VRM", "VRM 0"},
                                          {"VRMC_vrm", "VRM 1"},
                                          {"VRMC_vrm_animation", "VRM animation"}}) {
    const auto pointer = Json::json_pointer(cat("/extensions/", name, "/humanoid/humanBones"));
    if (!root.contains(pointer)) continue;
    const Json& bones = root.at(pointer);
    if (!bones.is_structured()) continue;
    for (const auto& [key, bone] : bones.items()) {
      std::string title = key;
      if (bones.is_array()) {
        if (!bone.is_object() || !bone.contains("bone") || !bone["bone"].is_string()) continue;
        title = bone["bone"].get<std::string>();
      }
      if (const int node = node_number(bone); node >= 0) out.emplace_back(title, node);
    }
    if (out.empty()) continue;
    *standard = title_of_it;
    break;
  }
  return out;
}

// ---- buffers -----------------------------------------------------------------------------------

void read_buffers(const Json& root, std::string_view binary, Document& document) {
  const auto list = root.find("buffers");
  if (list == root.end()) return;
  const std::string& path = document.path;
  if (!list->is_array()) broken(path, "has buffers that are no list");
  document.storage.reserve(list->size());  // views into short strings must not move
  for (const Json& item : *list) {
    const size_t number = document.buffers.size();
    const std::string title = cat("buffer ", number);
    if (!item.is_object() || !item.contains("byteLength") ||
        !item["byteLength"].is_number_unsigned())
      broken(path, title + " has no length");
    const uint64_t length = item["byteLength"].get<uint64_t>();
    std::string_view bytes = number == 0 ? binary : std::string_view();
    if (item.contains("uri")) {
      if (!item["uri"].is_string()) broken(path, title + " has an address that is no text");
      const std::string& uri = item["uri"].get_ref<const std::string&>();
      document.storage.push_back(uri.starts_with("data:") ? decode_data_uri(uri, length, path)
                                                          : read_neighbour(uri, path));
      bytes = document.storage.back();
      if (!uri.starts_with("data:")) document.payload += bytes.size();
    }
    if (length > bytes.size() && bytes.empty() && !document.compression.empty())
      refuse_compression(document.compression, path);  // its bytes come out of another buffer
    if (length > bytes.size())
      broken(path, cat(title, " has ", bytes.size(), " of its ", length, " bytes"));
    document.buffers.push_back(bytes.substr(0, length));
  }
}

/// tinygltf's own words, cut to something that fits a line.
std::string first_words(const std::string& message) {
  return text::quote(message.substr(0, message.find('\n')));
}

}  // namespace

Chunks split_glb(std::string_view content, const std::string& path) {
  static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "GLB is read as it lies in the file");
  if (content.size() < 20) broken(path, "is cut short in the header of a GLB file");
  if (word(content, 4) != 2)
    throw InputError(path, cat("is of glTF version ", word(content, 4)), "export it as glTF 2.0");
  const size_t length = word(content, 8);
  if (length > content.size())
    broken(path, cat("is cut short: ", content.size(), " of ", length, " bytes"));
  Chunks out;
  for (size_t at = 12; at + 8 <= length;) {
    const size_t size = word(content, at);
    const uint32_t kind = word(content, at + 4);
    if (size > length - at - 8) broken(path, "has a chunk that is longer than the file");
    if (kind == 0x4E4F534A && out.json.empty()) out.json = content.substr(at + 8, size);
    if (kind == 0x004E4942 && out.binary.empty()) out.binary = content.substr(at + 8, size);
    at += 8 + size;
  }
  if (out.json.empty()) broken(path, "holds no JSON chunk");
  return out;
}

std::string decode_percent(const std::string& text) {
  std::string out;
  for (size_t i = 0; i < text.size(); ++i) {
    const auto hex = [](char c) { return std::isxdigit(static_cast<unsigned char>(c)) != 0; };
    if (text[i] == '%' && i + 2 < text.size() && hex(text[i + 1]) && hex(text[i + 2])) {
      out += static_cast<char>(std::stoi(text.substr(i + 1, 2), nullptr, 16));
      i += 2;
    } else {
      out += text[i];
    }
  }
  return out;
}

std::string read_neighbour(const std::string& uri, const std::string& path) {
  const std::string name = decode_percent(uri);
  const auto refuse = [&](const std::string& what) {
    throw InputError(path, "names the file " + text::quote(name) + ", " + what,
                     "put all files of a character into one folder, or export a .glb");
  };
  if (name.find('\0') != std::string::npos || name.find("://") != std::string::npos)
    refuse("which is no file beside it");
  std::error_code error;
  const fs::path folder = fs::weakly_canonical(fs::absolute(path, error).parent_path(), error);
  const fs::path file = fs::weakly_canonical(folder / name, error);
  const fs::path inside = file.lexically_relative(folder);
  if (error || inside.empty() || *inside.begin() == ".." || inside == ".")
    refuse("which lies outside of its folder");
  if (!fs::is_regular_file(file, error)) refuse("which is not there");
  return read_file(file.string());
}

std::string decode_data_uri(const std::string& uri, size_t length, const std::string& path) {
  std::vector<unsigned char> bytes;
  std::string type;
  if (!tinygltf::IsDataURI(uri) || !tinygltf::DecodeDataURI(&bytes, type, uri, 0, false))
    broken(path, "has a buffer in its text that cannot be decoded");
  if (bytes.size() < length) broken(path, "has a buffer in its text that is cut short");
  return {bytes.begin(), bytes.end()};
}

void Allowance::spend(uint64_t count, uint64_t size) {
  if (count > left_ / size)
    throw InputError(path_, "names the same data again and again, or data that is not there",
                     "export it with every mesh once");
  left_ -= count * size;
}

void refuse_compression(const std::string& extension, const std::string& path) {
  const std::string name = fs::path(path).filename().string();
  const std::string shown = name.size() < 100 && text::is_utf8(name) ? name : "IN.glb";
  throw InputError(path,
                   cat("is compressed with ", compression_of(extension), " (", extension, ")"),
                   "unpack it: npx @gltf-transform/cli copy \"" + shown + "\" unpacked.glb");
}

void broken(const std::string& path, const std::string& what) {
  throw InputError(path, what, "export it again as GLB");
}

size_t checked(int64_t index, size_t size, const std::string& path, const std::string& what) {
  if (index < 0 || static_cast<uint64_t>(index) >= size)
    broken(path, cat("names ", what, " ", index, " of ", size));
  return static_cast<size_t>(index);
}

Document parse_document(std::string_view content, const std::string& path, bool looks) {
  refuse_foreign_content(content, path);
  Document out;
  out.path = path;
  out.payload = content.size();
  Chunks chunks{content, {}};
  if (content.starts_with("glTF")) chunks = split_glb(content, path);
  Json root = parse_json(chunks.json, content.size(), path, looks);
  if (looks) out.looks = take_looks(root);
  out.humanoid = read_humanoid(root, &out.standard);
  check_extensions(root, path);
  for (const std::string& name : extensions_in(root, "extensionsUsed"))
    if (!compression_of(name).empty()) out.compression = name;
  read_buffers(root, chunks.binary, out);
  root.erase("buffers");
  drop_extensions(root);
  const std::string reduced = root.dump();
  root = nullptr;
  tinygltf::TinyGLTF loader;
  std::string problem, warning;
  bool good = false;
  try {
    good = loader.LoadASCIIFromString(&out.model, &problem, &warning, reduced.data(),
                                      static_cast<unsigned int>(reduced.size()), "");
  } catch (const std::exception& error) {
    problem = error.what();
  }
  if (!good) broken(path, "is no usable glTF file (" + first_words(problem) + ")");
  if (!out.model.asset.version.starts_with("2"))
    throw InputError(path, "is of glTF version " + text::quote(out.model.asset.version),
                     "export it as glTF 2.0");
  return out;
}

}  // namespace restage::gltf
