#include "datasets/characters/mesh_document.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "autograd/base/atomic_file.h"
#include "autograd/base/words.h"
#include "datasets/readers/clouds/mesh_parsers.h"
#include "datasets/readers/clouds/obj_lines.h"
#include "datasets/readers/gltf/gltf_detail.h"
#include "datasets/readers/text/text.h"
#include "nn/geometry/glb_file.h"
#include "nn/geometry/normals.h"

namespace restage {
namespace {

using Json = nlohmann::ordered_json;
using Colour = std::array<float, 4>;

struct Material {
  std::string name;
  std::array<double, 3> colour = {0.8, 0.8, 0.8}, glow = {0, 0, 0};
  double opacity = 1;
  std::string picture, glow_picture;  ///< names of files
};

/// Numbers of a vertex, a texture coordinate and a normal; -1: none.
using Corner = std::array<int32_t, 3>;

/// The triangles of one material.
struct Surface {
  int material = -1;
  std::vector<Corner> corners;  ///< three a triangle
};

struct Look {
  Points vertices, normals;
  std::vector<std::array<float, 2>> uvs;
  std::vector<Colour> colours;  ///< of all vertices, or of none
  std::vector<Material> materials;
  std::vector<Surface> surfaces;
  std::vector<std::string> remarks;
};

/// Of what is painted in sRGB, as pictures and colours of vertices are.
float linear(double c) {
  return static_cast<float>(c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4));
}

template <size_t N, class T>
std::array<T, N> numbers(std::string_view line, T missing) {
  std::array<T, N> out;
  for (T& x : out) {
    double value = 0;
    x = text::parse(text::take_word(line), value) && std::isfinite(value) ? static_cast<T>(value)
                                                                          : missing;
  }
  return out;
}

// ---- MTL ---------------------------------------------------------------------------------------

std::string_view trimmed(std::string_view text) {
  const size_t first = text.find_first_not_of(" \t\r");
  if (first == text.npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

/// "-s 1 1 1 -bm 0.5 skin.png": the name of the file behind the options.
std::string picture_name(std::string_view line) {
  for (;;) {
    line = trimmed(line);
    std::string_view rest = line;
    if (!text::take_word(rest).starts_with('-')) break;
    double value = 0;
    line = rest;
    std::string_view word = text::take_word(rest);
    if (!text::parse(word, value)) line = rest;  // "-clamp on"
    for (std::string_view next = line; text::parse(text::take_word(next), value); line = next) {
    }
    if (trimmed(line).empty()) break;
  }
  std::string out(line);
  std::replace(out.begin(), out.end(), '\\', '/');
  return out;
}

void read_materials(std::string_view content, Look& look) {
  text::Lines lines(content);
  Material* now = nullptr;
  for (std::string_view line; lines.next(line);) {
    const std::string keyword = lower_case(text::take_word(line));
    if (keyword == "newmtl") {
      now = &look.materials.emplace_back();
      now->name = trimmed(line);
    }
    if (now == nullptr) continue;
    const auto share = [&](double missing) {
      return std::clamp(numbers<1>(line, missing)[0], 0.0, 1.0);
    };
    if (keyword == "kd") now->colour = numbers<3>(line, 0.8);
    if (keyword == "ke") now->glow = numbers<3>(line, 0.0);
    if (keyword == "d") now->opacity = share(1);
    if (keyword == "tr") now->opacity = 1 - share(0);
    if (keyword == "map_kd") now->picture = picture_name(line);
    if (keyword == "map_ke") now->glow_picture = picture_name(line);
  }
}

// ---- OBJ ---------------------------------------------------------------------------------------

class ObjReader {
 public:
  explicit ObjReader(const std::string& path) : path_(path) {}

  Look read(std::string_view content) {
    ObjLines lines(content);
    for (std::string_view line; lines.next(line);) take(line);
    if (look_.colours.size() != look_.vertices.size()) look_.colours.clear();
    return std::move(look_);
  }

 private:
  void take(std::string_view line) {
    const std::string_view keyword = text::take_word(line);
    if (keyword == "v") {
      const auto all = numbers<6>(line, NAN);
      look_.vertices.emplace_back(all[0], all[1], all[2]);
      if (!std::isnan(all[5])) look_.colours.push_back({all[3], all[4], all[5], 1});
    } else if (keyword == "vt") {
      look_.uvs.push_back(numbers<2>(line, 0.0f));
    } else if (keyword == "vn") {
      const auto n = numbers<3>(line, 0.0f);
      look_.normals.emplace_back(n[0], n[1], n[2]);
    } else if (keyword == "f") {
      take_face(line);
    } else if (keyword == "usemtl") {
      use(std::string(trimmed(line)));
    } else if (keyword == "mtllib") {
      take_library(std::string(trimmed(line)));
    }
  }

  /// A file name with blanks, or several names.
  void take_library(const std::string& names) {
    std::vector<std::string> all = {names};
    for (std::string_view rest = names; names.find(' ') != names.npos;) {
      const std::string_view word = text::take_word(rest);
      if (word.empty()) break;
      all.emplace_back(word);
    }
    bool found = false;
    for (const std::string& name : all) {
      if (found && &name == &all.front()) break;
      try {
        const std::string content = gltf::read_neighbour(plain(name), path_);
        read_materials(text::without_mark(content, name), look_);
        found = true;
        if (&name == &all.front()) break;
      } catch (const InputError&) {
        continue;
      }
    }
    if (!found)
      look_.remarks.push_back(
          cat("names the materials ", text::quote(names), ", which are not beside it"));
  }

  /// Names are no addresses, in which '%' says something.
  static std::string plain(std::string name) {
    std::replace(name.begin(), name.end(), '\\', '/');
    std::string out;
    for (const char c : name) c == '%' ? out += "%25" : out += c;
    return out;
  }

  void use(const std::string& name) {
    int number = -1;
    for (size_t m = 0; m < look_.materials.size(); ++m)
      if (look_.materials[m].name == name) number = static_cast<int>(m);
    if (number < 0 && !name.empty()) {
      number = static_cast<int>(look_.materials.size());
      look_.materials.emplace_back().name = name;
    }
    const auto same = [&](const Surface& s) { return s.material == number; };
    const auto at = std::find_if(look_.surfaces.begin(), look_.surfaces.end(), same);
    now_ = static_cast<size_t>(at - look_.surfaces.begin());
    if (at == look_.surfaces.end()) look_.surfaces.push_back({number, {}});
  }

  void take_face(std::string_view line) {
    if (look_.surfaces.empty()) use("");
    std::vector<Corner> face;
    for (std::string_view word = text::take_word(line); !word.empty() && word[0] != '#';
         word = text::take_word(line))
      face.push_back(corner(word));
    for (size_t k = 2; k < face.size(); ++k)
      for (const size_t c : {size_t{0}, k - 1, k}) look_.surfaces[now_].corners.push_back(face[c]);
  }

  /// What lies outside of the file's lists is not there.
  Corner corner(std::string_view word) const {
    const std::array<size_t, 3> counts = {look_.vertices.size(), look_.uvs.size(),
                                          look_.normals.size()};
    Corner out = {-1, -1, -1};
    for (size_t k = 0; k < 3 && !word.empty(); ++k) {
      const size_t end = std::min(word.find('/'), word.size());
      int64_t index = 0;
      if (text::parse(word.substr(0, end), index)) {
        const auto count = static_cast<int64_t>(counts[k]);
        const int64_t at = index < 0 ? count + index : index - 1;
        // A vertex may come later in the file; read_mesh() has checked it.
        if (at >= 0 && at <= INT32_MAX && (k == 0 || at < count)) out[k] = static_cast<int32_t>(at);
      }
      word.remove_prefix(std::min(end + 1, word.size()));
    }
    return out;
  }

  const std::string& path_;
  Look look_;
  size_t now_ = 0;
};

Look read_ply(std::string_view content, const std::string& path) {
  Look out;
  Mesh mesh = parse_ply(content, path, Vec3::Zero(), NonFinite::mark, &out.colours);
  out.vertices = std::move(mesh.vertices);
  Surface& all = out.surfaces.emplace_back();
  for (const Triangle& t : mesh.faces)
    for (const int32_t v : t) all.corners.push_back({v, -1, -1});
  return out;
}

// ---- glTF --------------------------------------------------------------------------------------

class Maker {
 public:
  Maker(const Look& look, const std::string& path, bool small)
      : look_(look), path_(path), small_(small) {
    std::vector<Triangle> faces;
    for (const Surface& s : look.surfaces)
      for (size_t k = 0; k + 2 < s.corners.size(); k += 3)
        faces.push_back({s.corners[k][0], s.corners[k + 1][0], s.corners[k + 2][0]});
    made_normals_ = vertex_normals<Point>(look.vertices, faces, Point::UnitY());
  }

  MeshDocument make() {
    Json materials = Json::array(), primitives = Json::array();
    for (const Material& m : look_.materials) materials.push_back(material(m));
    for (const Surface& s : look_.surfaces)
      if (!s.corners.empty()) primitives.push_back(primitive(s));
    Json root = {{"asset", {{"version", "2.0"}, {"generator", "restage"}}},
                 {"scene", 0},
                 {"scenes", {{{"nodes", {0}}}}},
                 {"nodes", {{{"name", std::filesystem::path(path_).stem().string()}, {"mesh", 0}}}},
                 {"meshes", {{{"primitives", primitives}}}}};
    if (!materials.empty()) root["materials"] = materials;
    if (small_)
      root["extensionsUsed"] = root["extensionsRequired"] = Json::array({"KHR_mesh_quantization"});
    for (auto& [name, list] :
         std::map<std::string, Json*>{{"images", &images_}, {"textures", &textures_}})
      if (!list->empty()) root[name] = *list;
    root["bufferViews"] = views_;
    root["accessors"] = accessors_;
    root["buffers"] = {{{"byteLength", binary_.size()}}};
    out_.remarks.insert(out_.remarks.begin(), look_.remarks.begin(), look_.remarks.end());
    out_.glb = glb_bytes(root.dump(-1, ' ', false, Json::error_handler_t::replace), binary_, path_);
    return std::move(out_);
  }

 private:
  size_t view(const void* data, size_t bytes, int target, int stride = 0) {
    binary_.resize((binary_.size() + 3) / 4 * 4);
    Json view = {{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", bytes}};
    if (stride != 0) view["byteStride"] = stride;
    if (target != 0) view["target"] = target;
    binary_.append(static_cast<const char*>(data), bytes);
    views_.push_back(std::move(view));
    return views_.size() - 1;
  }

  template <class T>
  size_t accessor(const std::vector<T>& rows, const char* type, int component, int target) {
    accessors_.push_back({{"bufferView", view(rows.data(), rows.size() * sizeof(T), target)},
                          {"componentType", component},
                          {"count", rows.size()},
                          {"type", type}});
    return accessors_.size() - 1;
  }

  Json primitive(const Surface& surface) {
    constexpr int kFloat = 5126, kUnsigned = 5125, kVertices = 34962, kIndices = 34963;
    std::map<Corner, uint32_t> numbers;
    std::vector<Corner> rows;
    std::vector<uint32_t> indices;
    for (const Corner& corner : surface.corners) {
      const auto [at, added] = numbers.emplace(corner, static_cast<uint32_t>(rows.size()));
      if (added) rows.push_back(corner);
      indices.push_back(at->second);
    }
    Points places, normals;
    std::vector<std::array<float, 2>> uvs;
    std::vector<Colour> colours;
    bool with_uvs = false;
    for (const Corner& row : rows) {
      const auto v = static_cast<size_t>(row[0]);
      out_.vertex.push_back(row[0]);
      places.push_back(look_.vertices[v]);
      const Point given =
          row[2] < 0 ? Point::Zero().eval() : look_.normals[static_cast<size_t>(row[2])];
      normals.push_back(given.norm() > 1e-6f ? given.normalized().eval() : made_normals_[v]);
      with_uvs = with_uvs || row[1] >= 0;
      const std::array<float, 2> uv =
          row[1] < 0 ? std::array<float, 2>{0, 1} : look_.uvs[static_cast<size_t>(row[1])];
      uvs.push_back({uv[0], 1 - uv[1]});
      if (look_.colours.empty()) continue;
      const Colour& c = look_.colours[v];
      colours.push_back({linear(c[0]), linear(c[1]), linear(c[2]), c[3]});
    }
    Json attributes = {{"POSITION", accessor(places, "VEC3", kFloat, kVertices)}};
    Point low = places[0], high = low;
    for (const Point& p : places) low = low.cwiseMin(p), high = high.cwiseMax(p);
    accessors_.back()["min"] = {low.x(), low.y(), low.z()};
    accessors_.back()["max"] = {high.x(), high.y(), high.z()};
    attributes["NORMAL"] =
        small_ ? short_normals(normals) : accessor(normals, "VEC3", kFloat, kVertices);
    if (with_uvs)
      attributes["TEXCOORD_0"] = small_ ? short_uvs(uvs) : accessor(uvs, "VEC2", kFloat, kVertices);
    if (!colours.empty()) attributes["COLOR_0"] = accessor(colours, "VEC4", kFloat, kVertices);
    const bool few = small_ && rows.size() < 65535;
    Json out = {{"attributes", attributes},
                {"indices",
                 few ? short_indices(indices) : accessor(indices, "SCALAR", kUnsigned, kIndices)}};
    if (surface.material >= 0) out["material"] = surface.material;
    return out;
  }

  size_t short_normals(const Points& normals) {
    std::vector<std::array<int8_t, 4>> rows;
    for (const Point& n : normals) {
      std::array<int8_t, 4>& row = rows.emplace_back();
      for (size_t k = 0; k < 3; ++k)
        row[k] = static_cast<int8_t>(std::lround(127 * n[static_cast<int>(k)]));
    }
    accessors_.push_back({{"bufferView", view(rows.data(), 4 * rows.size(), 34962, 4)},
                          {"componentType", 5120},
                          {"normalized", true},
                          {"count", rows.size()},
                          {"type", "VEC3"}});
    return accessors_.size() - 1;
  }

  size_t short_uvs(const std::vector<std::array<float, 2>>& uvs) {
    std::vector<std::array<uint16_t, 2>> rows;
    for (const auto& uv : uvs)
      rows.push_back({static_cast<uint16_t>(std::lround(65535 * std::clamp(uv[0], 0.0f, 1.0f))),
                      static_cast<uint16_t>(std::lround(65535 * std::clamp(uv[1], 0.0f, 1.0f)))});
    accessors_.push_back({{"bufferView", view(rows.data(), 4 * rows.size(), 34962)},
                          {"componentType", 5123},
                          {"normalized", true},
                          {"count", rows.size()},
                          {"type", "VEC2"}});
    return accessors_.size() - 1;
  }

  size_t short_indices(const std::vector<uint32_t>& indices) {
    const std::vector<uint16_t> rows(indices.begin(), indices.end());
    return accessor(rows, "SCALAR", 5123, 34963);
  }

  Json material(const Material& m) {
    Json pbr = {{"metallicFactor", 0}, {"roughnessFactor", 0.9}};
    std::array<double, 4> colour = {1, 1, 1, std::clamp(m.opacity, 0.0, 1.0)};
    const std::optional<size_t> picture = texture(m.picture), glow = texture(m.glow_picture);
    if (picture)
      pbr["baseColorTexture"] = {{"index", *picture}};
    else
      for (size_t k = 0; k < 3; ++k) colour[k] = linear(std::clamp(m.colour[k], 0.0, 1.0));
    pbr["baseColorFactor"] = colour;
    Json out = {{"name", m.name}, {"pbrMetallicRoughness", pbr}, {"doubleSided", true}};
    if (colour[3] < 1) out["alphaMode"] = "BLEND";
    if (glow) out["emissiveTexture"] = {{"index", *glow}};
    std::array<double, 3> factor = {1, 1, 1};
    for (size_t k = 0; k < 3 && !glow; ++k) factor[k] = std::clamp(m.glow[k], 0.0, 1.0);
    if (glow || factor != std::array<double, 3>{0, 0, 0}) out["emissiveFactor"] = factor;
    return out;
  }

  /// The file's bytes, once.
  std::optional<size_t> texture(const std::string& name) {
    if (name.empty()) return {};
    if (const auto known = known_.find(name); known != known_.end()) return known->second;
    std::optional<size_t>& out = known_[name];
    std::string bytes, uri;
    for (const char c : name) c == '%' ? uri += "%25" : uri += c;
    try {
      bytes = gltf::read_neighbour(uri, path_);
    } catch (const InputError&) {
      try {
        bytes = gltf::read_neighbour(std::filesystem::path(uri).filename().string(), path_);
      } catch (const InputError&) {
        out_.remarks.push_back(
            cat("names the picture ", text::quote(name), ", which is not beside it"));
        return {};
      }
    }
    const char* kind = bytes.starts_with("\x89PNG\r\n")    ? "image/png"
                       : bytes.starts_with("\xff\xd8\xff") ? "image/jpeg"
                                                           : nullptr;
    if (kind == nullptr) {
      out_.remarks.push_back(cat("names the picture ", text::quote(name),
                                 ", which is neither PNG nor JPEG: left out"));
      return {};
    }
    images_.push_back({{"name", std::filesystem::path(name).stem().string()},
                       {"mimeType", kind},
                       {"bufferView", view(bytes.data(), bytes.size(), 0)}});
    textures_.push_back({{"source", images_.size() - 1}});
    return out = textures_.size() - 1;
  }

  const Look& look_;
  const std::string& path_;
  const bool small_;
  Points made_normals_;
  MeshDocument out_;
  std::string binary_;
  Json views_ = Json::array(), accessors_ = Json::array(), images_ = Json::array(),
       textures_ = Json::array();
  std::map<std::string, std::optional<size_t>> known_;
};

bool has_look(const Look& look) {
  return !look.uvs.empty() || !look.colours.empty() || !look.materials.empty();
}

bool is_whole(const Look& look, size_t vertices) {
  bool faces = false;
  for (const Surface& s : look.surfaces)
    for (const Corner& c : s.corners) {
      faces = true;
      if (c[0] < 0 || static_cast<size_t>(c[0]) >= vertices) return false;
    }
  return faces && look.vertices.size() == vertices &&
         (look.colours.empty() || look.colours.size() == vertices);
}

}  // namespace

std::optional<MeshDocument> mesh_document(const std::string& path, size_t vertices, bool small) {
  const bool obj = text::ends_in(path, {".obj"});
  if (!obj && !text::ends_in(path, {".ply"})) return {};
  const std::string content = read_file(path);
  const std::string_view text = text::without_mark(content, path);
  const Look look = obj ? ObjReader(path).read(text) : read_ply(text, path);
  if (!has_look(look) || !is_whole(look, vertices)) return {};
  return Maker(look, path, small).make();
}

}  // namespace restage
