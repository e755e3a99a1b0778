// What glTF files say of looks: attributes of vertices, materials, pictures, morph targets. Nothing
// of it is trusted, and nothing of it ends the reading.
#include "datasets/readers/gltf/gltf_look.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "autograd/base/atomic_file.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/gltf/gltf_detail.h"
#include "datasets/readers/text/text.h"

namespace restage {
namespace {

using gltf::Allowance;
using gltf::Document;
using Looks = nlohmann::json;

// ---- values of a structure that may hold anything
// ------------------------------------------------

const Looks& part(const Looks& value, const char* path) {
  static const Looks kNothing;
  const auto at = Looks::json_pointer(path);
  return value.is_structured() && value.contains(at) ? value.at(at) : kNothing;
}

float number(const Looks& value, float otherwise) {
  if (!value.is_number()) return otherwise;
  const double x = value.get<double>();
  return std::abs(x) < 1e9 ? static_cast<float>(x) : otherwise;
}

int index_of(const Looks& value, size_t count) {
  return value.is_number_unsigned() && value.get<uint64_t>() < count ? value.get<int>() : -1;
}

template <class Vector>
Vector numbers(const Looks& value, Vector otherwise) {
  for (int k = 0; k < otherwise.size(); ++k)
    if (value.is_array() && value.size() > static_cast<size_t>(k))
      otherwise[k] = number(value[static_cast<size_t>(k)], otherwise[k]);
  return otherwise;
}

std::string words(const Looks& value) { return value.is_string() ? value.get<std::string>() : ""; }

Texture::Wrap wrap_of(const Looks& value) {
  if (value == 33071) return Texture::Wrap::clamp;
  return value == 33648 ? Texture::Wrap::mirror : Texture::Wrap::repeat;
}

/// The extension KHR_texture_transform: scaled, then turned, then moved.
Eigen::Matrix<float, 2, 3> transform_of(const Looks& value) {
  const Uv offset = numbers(part(value, "/offset"), Uv(0, 0)),
           scale = numbers(part(value, "/scale"), Uv(1, 1));
  const float turn = number(part(value, "/rotation"), 0);
  Eigen::Matrix<float, 2, 3> out;
  out << std::cos(turn) * scale.x(), std::sin(turn) * scale.y(), offset.x(),
      -std::sin(turn) * scale.x(), std::cos(turn) * scale.y(), offset.y();
  return out;
}

class LookReader {
 public:
  LookReader(const Document& document, Allowance& allowance)
      : document_(document), allowance_(allowance), looks_(Looks::parse(document.looks)) {}

  GltfLook read() {
    gltf::Runs runs;
    out_.file = gltf::build(document_, allowance_, &runs);
    read_materials();
    for (const auto& run : runs.faces)
      out_.look.material.insert(out_.look.material.end(), run.count, material_of(*run.primitive));
    read_animations(runs);
    read_weights();
    for (const auto& run : runs.vertices) read_vertices(run);
    out_.look.colours.resize(out_.look.colours.empty() ? 0 : vertices(), Rgba::Ones());
    out_.look.uv.resize(out_.look.uv.empty() ? 0 : vertices(), Uv::Zero());
    return std::move(out_);
  }

 private:
  size_t vertices() const { return out_.file.vertices.size(); }
  void remark(const std::string& text) {
    auto& all = out_.file.remarks;
    if (std::find(all.begin(), all.end(), text) == all.end()) all.push_back(text);
  }

  // ---- materials ----

  void read_materials() {
    const Looks& list = part(looks_, "/materials");
    if (list.is_array())
      for (const Looks& item : list) out_.look.materials.push_back(material(item));
    out_.look.materials.emplace_back();  // of primitives that name none
  }

  Material material(const Looks& item) {
    Material out;
    uv_set_.push_back(0);
    out.name = words(part(item, "/name"));
    const Looks& gloss = part(item, "/extensions/KHR_materials_pbrSpecularGlossiness");
    const Looks& rough = part(item, "/pbrMetallicRoughness");
    const bool plain = rough.is_object() || !gloss.is_object();
    out.colour = numbers(plain ? part(rough, "/baseColorFactor") : part(gloss, "/diffuseFactor"),
                         Rgba(1, 1, 1, 1))
                     .cwiseMax(0)
                     .cwiseMin(1);
    out.texture = texture(plain ? part(rough, "/baseColorTexture") : part(gloss, "/diffuseTexture"),
                          &uv_set_.back());
    const float strength =
        number(part(item, "/extensions/KHR_materials_emissive_strength/emissiveStrength"), 1);
    out.glow = strength * numbers(part(item, "/emissiveFactor"), Eigen::Vector3f(0, 0, 0));
    out.glow = out.glow.cwiseMax(0).cwiseMin(4);
    int set = uv_set_.back();
    if (!out.glow.isZero()) out.glow_texture = texture(part(item, "/emissiveTexture"), &set);
    if (set != uv_set_.back() && out.texture.picture < 0) uv_set_.back() = set;
    if (set != uv_set_.back()) {
      out.glow.setZero();
      remark("left out light of its own that has other texture coordinates than the colour");
    }
    const std::string mode = words(part(item, "/alphaMode"));
    if (mode == "MASK") out.alpha = Material::Alpha::mask;
    if (mode == "BLEND") out.alpha = Material::Alpha::blend;
    out.cutoff = number(part(item, "/alphaCutoff"), 0.5f);
    out.two_sided = part(item, "/doubleSided") == true;
    out.unlit = part(item, "/extensions/KHR_materials_unlit").is_object();
    return out;
  }

  Texture texture(const Looks& use, int* uv_set) {
    Texture out;
    const Looks& list = part(looks_, "/textures");
    const int which = index_of(part(use, "/index"), list.is_array() ? list.size() : 0);
    if (which < 0) return out;
    const Looks& item = list[static_cast<size_t>(which)];
    const Looks& webp = part(item, "/extensions/EXT_texture_webp/source");
    out.picture = picture(webp.is_number() ? webp : part(item, "/source"));
    const Looks& samplers = part(looks_, "/samplers");
    const int s = index_of(part(item, "/sampler"), samplers.is_array() ? samplers.size() : 0);
    if (s >= 0) {
      const Looks& sampler = samplers[static_cast<size_t>(s)];
      out.across = wrap_of(part(sampler, "/wrapS"));
      out.down = wrap_of(part(sampler, "/wrapT"));
      out.nearest = part(sampler, "/magFilter") == 9728;
    }
    const Looks& moved = part(use, "/extensions/KHR_texture_transform");
    out.transform = transform_of(moved);
    const Looks& set = part(moved, "/texCoord");
    *uv_set = static_cast<int>(
        std::clamp(number(set.is_number() ? set : part(use, "/texCoord"), 0), 0.0f, 99.0f));
    return out;
  }

  /// The picture's place in the list, in which each stands once.
  int picture(const Looks& source) {
    const Looks& list = part(looks_, "/images");
    const int which = index_of(source, list.is_array() ? list.size() : 0);
    if (which < 0) {
      remark("left out a texture that names no picture that is known here");
      return -1;
    }
    const auto known = picture_.find(which);
    if (known != picture_.end()) return known->second;
    const Looks& item = list[static_cast<size_t>(which)];
    PictureFile file;
    const std::string uri = words(part(item, "/uri")), name = words(part(item, "/name"));
    file.name = !name.empty()                             ? name
                : uri.empty() || uri.starts_with("data:") ? cat("picture ", which)
                                                          : uri;
    try {
      file.bytes = picture_bytes(item, uri);
      allowance_.spend(file.bytes.size(), 1);
    } catch (const InputError& error) {
      file.bytes.clear();
      remark(cat("left out the picture ", text::quote(file.name), ": ", error.what()));
    }
    out_.look.pictures.push_back(std::move(file));
    return picture_[which] = static_cast<int>(out_.look.pictures.size()) - 1;
  }

  std::string picture_bytes(const Looks& item, const std::string& uri) const {
    if (uri.starts_with("data:")) return gltf::decode_data_uri(uri, 0, document_.path);
    if (!uri.empty()) return gltf::read_neighbour(uri, document_.path);
    const auto& views = document_.model.bufferViews;
    const int view = index_of(part(item, "/bufferView"), views.size());
    if (view < 0) throw InputError("", "it has no bytes", "export it with its pictures");
    const auto& span = views[static_cast<size_t>(view)];
    const auto& buffers = document_.buffers;
    const std::string_view bytes =
        buffers[gltf::checked(span.buffer, buffers.size(), document_.path, "buffer")];
    if (span.byteOffset > bytes.size() || span.byteLength > bytes.size() - span.byteOffset)
      throw InputError("", "its bytes lie outside of the file", "export it again");
    return std::string(bytes.substr(span.byteOffset, span.byteLength));
  }

  int32_t material_of(const tinygltf::Primitive& primitive) const {
    const auto last = static_cast<int>(out_.look.materials.size()) - 1;
    return primitive.material >= 0 && primitive.material < last ? primitive.material : last;
  }

  // ---- vertices ----

  /// An attribute of a primitive, if it is there and of the right size.
  std::vector<float> attribute(const gltf::Runs::Vertices& run, const std::string& name,
                               int* width) {
    const auto at = run.primitive->attributes.find(name);
    const auto& list = document_.model.accessors;
    if (at == run.primitive->attributes.end()) return {};
    try {
      const auto& accessor =
          list[gltf::checked(at->second, list.size(), document_.path, "accessor")];
      const bool four = accessor.type == TINYGLTF_TYPE_VEC4 && *width == 3 && name == "COLOR_0";
      if (four) *width = 4;
      static constexpr int kTypes[] = {TINYGLTF_TYPE_VEC2, TINYGLTF_TYPE_VEC3, TINYGLTF_TYPE_VEC4};
      std::vector<float> out =
          gltf::read_floats(document_, at->second, kTypes[*width - 2], name, allowance_);
      if (out.size() == static_cast<size_t>(*width) * run.count) return out;
      remark(cat("left out ", name, " of another number of vertices"));
    } catch (const InputError& error) {
      remark(cat("left out ", name, ": ", error.what()));
    }
    return {};
  }

  void read_vertices(const gltf::Runs::Vertices& run) {
    Appearance& look = out_.look;
    const int material = material_of(*run.primitive);
    const int set = static_cast<size_t>(material) < uv_set_.size() ? uv_set_[material] : 0;
    int width = 2;
    const std::vector<float> uv = attribute(run, cat("TEXCOORD_", set), &width);
    if (!uv.empty()) {
      look.uv.resize(run.first + run.count, Uv::Zero());
      for (size_t v = 0; v < run.count; ++v)
        look.uv[run.first + v] = Uv(uv[2 * v], uv[2 * v + 1]).cwiseMax(-1e6f).cwiseMin(1e6f);
    }
    width = 3;
    const std::vector<float> colour = attribute(run, "COLOR_0", &width);
    if (!colour.empty()) {
      look.colours.resize(run.first + run.count, Rgba::Ones());
      for (size_t v = 0; v < run.count; ++v)
        for (int k = 0; k < width; ++k)
          look.colours[run.first + v][k] = std::clamp(colour[v * width + k], 0.0f, 1.0f);
    }
    int three = 3;
    join(run, attribute(run, "NORMAL", &three));
    read_morphs(run);
  }

  /// Vertices at one place, with about one normal, are one point of a smooth surface.
  void join(const gltf::Runs::Vertices& run, const std::vector<float>& normals) {
    constexpr float kSameSide = 0.8f;  // cosine: edges that are meant to be sharp are sharper
    const auto normal = [&](int32_t v) -> Point {
      return normals.empty() ? Point(0, 0, 0)
                             : Point(Eigen::Map<const Point>(&normals[3 * (v - run.first)]));
    };
    std::map<std::array<float, 3>, std::vector<int32_t>> known;  // per place: its smooth points
    for (size_t v = run.first; v < run.first + run.count; ++v) {
      const Point& p = out_.file.vertices[v];
      std::vector<int32_t>& here = known[{p.x(), p.y(), p.z()}];
      const auto number = static_cast<int32_t>(v);
      const auto same = std::find_if(here.begin(), here.end(), [&](int32_t other) {
        return normals.empty() || normal(other).dot(normal(number)) > kSameSide;
      });
      out_.look.smooth.push_back(same == here.end() ? number : *same);
      // A file may put all its vertices into one place.
      if (same == here.end() && here.size() < 16) here.push_back(number);
    }
  }

  // ---- morph targets ----

  void read_animations(const gltf::Runs& runs) {
    const Looks& ours = part(looks_, "/ours");
    out_.weight_tracks.resize(out_.file.clips.size());
    for (size_t c = 0; c < out_.file.clips.size(); ++c) {
      const size_t number = runs.animations.at(c);
      out_.ours.push_back(ours.is_array() && number < ours.size() && ours[number] == true);
      const tinygltf::Animation& animation = document_.model.animations[number];
      GltfClip& clip = out_.file.clips[c];
      for (const auto& channel : animation.channels) {
        if (channel.target_path != "weights" || channel.target_node < 0) continue;
        try {
          read_weight_track(animation, channel, runs, c);
        } catch (const InputError& error) {
          remark(cat("left out weights of morph targets in clip ", text::quote(clip.name), ": ",
                     error.what()));
        }
      }
      if (!(clip.begin <= clip.end)) clip.begin = clip.end = 0;
    }
  }

  void read_weight_track(const tinygltf::Animation& animation,
                         const tinygltf::AnimationChannel& channel, const gltf::Runs& runs,
                         size_t c) {
    const std::string& path = document_.path;
    const auto& sampler =
        animation
            .samplers[gltf::checked(channel.sampler, animation.samplers.size(), path, "sampler")];
    GltfWeightTrack track;
    track.node = runs.place[gltf::checked(channel.target_node, runs.place.size(), path, "node")];
    track.interpolation = sampler.interpolation == "CUBICSPLINE" ? GltfTrack::Interpolation::cubic
                          : sampler.interpolation == "STEP"      ? GltfTrack::Interpolation::step
                                                                 : GltfTrack::Interpolation::linear;
    std::vector<float> times =
        gltf::read_floats(document_, sampler.input, TINYGLTF_TYPE_SCALAR, "key times", allowance_);
    if (!std::is_sorted(times.begin(), times.end())) gltf::broken(path, "has key times that fall");
    track.values =
        gltf::read_floats(document_, sampler.output, TINYGLTF_TYPE_SCALAR, "weights", allowance_);
    const size_t keys =
        times.size() * (track.interpolation == GltfTrack::Interpolation::cubic ? 3 : 1);
    track.targets = track.values.size() / keys;
    if (track.targets == 0 || track.values.size() != keys * track.targets)
      gltf::broken(path, "has keys without weights");
    for (float& x : track.values) x = std::clamp(x, -1e3f, 1e3f);
    GltfClip& clip = out_.file.clips[c];
    clip.begin = std::min(clip.begin, double{times.front()});
    clip.end = std::max(clip.end, double{times.back()});
    track.times = static_cast<int>(out_.file.times.size());
    out_.file.times.push_back(std::move(times));
    out_.weight_tracks[c].push_back(std::move(track));
  }

  /// At rest: those of the node, else those of its mesh.
  void read_weights() {
    const tinygltf::Model& model = document_.model;
    for (const GltfNode& node : out_.file.nodes) {
      const tinygltf::Node& in = model.nodes[static_cast<size_t>(node.number)];
      const bool has_mesh = in.mesh >= 0 && static_cast<size_t>(in.mesh) < model.meshes.size();
      const std::vector<double> none;
      const auto& values = !in.weights.empty() ? in.weights
                           : has_mesh          ? model.meshes[static_cast<size_t>(in.mesh)].weights
                                               : none;
      std::vector<float>& weights = out_.weights.emplace_back();
      for (const double w : values)
        weights.push_back(std::abs(w) < 1e3 ? static_cast<float>(w) : 0.0f);
    }
  }

  bool is_used(int node, size_t target) const {
    const auto& rest = out_.weights[static_cast<size_t>(node)];
    if (target < rest.size() && rest[target] != 0) return true;
    for (const auto& tracks : out_.weight_tracks)
      for (const GltfWeightTrack& track : tracks)
        for (size_t k = target; track.node == node && k < track.values.size(); k += track.targets)
          if (target < track.targets && track.values[k] != 0) return true;
    return false;
  }

  void read_morphs(const gltf::Runs::Vertices& run) {
    GltfMorphs morphs{run.node, run.first, {}};
    for (size_t t = 0; t < run.primitive->targets.size(); ++t) {
      Points& target = morphs.targets.emplace_back();
      const auto& attributes = run.primitive->targets[t];
      const auto at = attributes.find("POSITION");
      if (at == attributes.end() || !is_used(run.node, t)) continue;
      try {
        const std::vector<float> xyz = gltf::read_floats(document_, at->second, TINYGLTF_TYPE_VEC3,
                                                         "morph targets", allowance_);
        if (xyz.size() != 3 * run.count)
          gltf::broken(document_.path, "has morph targets of another number of vertices");
        allowance_.spend(run.count, sizeof(Point));
        for (size_t v = 0; v < run.count; ++v)
          target.push_back(
              Point(xyz[3 * v], xyz[3 * v + 1], xyz[3 * v + 2]).cwiseMax(-1e9f).cwiseMin(1e9f));
      } catch (const InputError& error) {
        target.clear();
        remark(cat("left out a morph target: ", error.what()));
      }
    }
    if (!morphs.targets.empty()) out_.morphs.push_back(std::move(morphs));
  }

  const Document& document_;
  Allowance& allowance_;
  const Looks looks_;
  GltfLook out_;
  std::vector<int> uv_set_;     // per material: which texture coordinates its picture has
  std::map<int, int> picture_;  // of a number in the file: its place
};

}  // namespace

GltfLook parse_gltf_look(std::string_view content, const std::string& path) {
  const Document document = gltf::parse_document(content, path, true);
  Allowance allowance(document.payload, path);
  return LookReader(document, allowance).read();
}

GltfLook read_gltf_look(const std::string& path) {
  std::vector<std::string> remarks;
  GltfLook out = parse_gltf_look(read_gltf_bytes(path, &remarks), path);
  out.file.remarks.insert(out.file.remarks.begin(), remarks.begin(), remarks.end());
  return out;
}

}  // namespace restage
