// From tinygltf's structures to plain values: nodes in order, one surface, skins, animations.
#include "datasets/readers/gltf/gltf.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "autograd/base/atomic_file.h"
#include "autograd/base/words.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/fbx/fbx.h"
#include "datasets/readers/foreign_kinds.h"
#include "datasets/readers/gltf/gltf_detail.h"
#include "datasets/readers/text/text.h"

namespace restage {
namespace {

using gltf::Allowance;
using gltf::broken;
using gltf::checked;
using gltf::Document;

constexpr double kLargest = 1e9;  // of a length; anything larger is a broken file

std::string name_of(const char* kind, size_t index) { return cat(kind, " ", index); }

/// Numbers of a node's property: none, or exactly `count` finite ones.
bool has_numbers(const std::vector<double>& values, size_t count, const std::string& path,
                 const std::string& what) {
  if (values.empty()) return false;
  if (values.size() != count)
    broken(path, cat(what, " has ", values.size(), " numbers, not ", count));
  for (const double x : values)
    if (!(std::abs(x) < kLargest)) broken(path, what + " is out of range");
  return true;
}

/// A matrix without shear as translation, rotation and scale (a mirror goes into the x scale).
void decompose(const std::vector<double>& m, GltfNode& node) {
  const Mat3 linear = Eigen::Matrix4d(m.data()).topLeftCorner<3, 3>();
  node.translation = Vec3(m[12], m[13], m[14]);
  node.scale = linear.colwise().norm().transpose();
  if (linear.determinant() < 0) node.scale.x() = -node.scale.x();
  if (node.scale.cwiseAbs().minCoeff() < 1e-12) return;
  const Mat3 rotation = linear * node.scale.cwiseInverse().asDiagonal();
  node.rotation = Quat(rotation).normalized();
}

class Builder {
 public:
  Builder(const Document& document, Allowance& allowance, gltf::Runs* runs)
      : document_(document),
        model_(document.model),
        path_(document.path),
        allowance_(allowance),
        runs_(runs) {
    out_.path = path_;
    out_.bytes = document.payload;
  }

  Gltf build() {
    order_nodes();
    mark_scene();
    for (size_t n = 0; n < order_.size(); ++n) read_node(n);
    for (size_t s = 0; s < model_.skins.size(); ++s) read_skin(s);
    read_meshes();
    for (size_t a = 0; a < model_.animations.size(); ++a) read_animation(a);
    for (const auto& [name, node] : document_.humanoid)
      out_.humanoid.emplace_back(name, place_[checked(node, place_.size(), path_, "node")]);
    out_.standard = document_.standard;
    report();
    if (runs_ != nullptr) runs_->place = place_;
    return std::move(out_);
  }

 private:
  struct Wearer {
    size_t node, mesh;
    int skin;
  };

  // ---- nodes ----

  /// Parents before children; a node with two parents or a circle of nodes is refused.
  void order_nodes() {
    const size_t n = model_.nodes.size();
    std::vector<int> parent(n, -1);
    for (size_t i = 0; i < n; ++i)
      for (const int child : model_.nodes[i].children) {
        const size_t c = checked(child, n, path_, "node");
        if (parent[c] >= 0 || c == i) broken(path_, name_of("node", c) + " has several parents");
        parent[c] = static_cast<int>(i);
      }
    for (size_t i = 0; i < n; ++i)
      if (parent[i] < 0) order_.push_back(i);
    for (size_t at = 0; at < order_.size(); ++at)
      for (const int child : model_.nodes[order_[at]].children)
        order_.push_back(static_cast<size_t>(child));
    if (order_.size() != n) broken(path_, "its nodes go round in circles");
    place_.resize(n);
    for (size_t i = 0; i < n; ++i) place_[order_[i]] = static_cast<int>(i);
    parent_ = std::move(parent);
  }

  /// What the default scene shows; everything, if there are no scenes.
  void mark_scene() {
    const auto& scenes = model_.scenes;
    shown_.assign(order_.size(), scenes.empty());
    if (scenes.empty()) return;
    const int number = model_.defaultScene < 0 ? 0 : model_.defaultScene;
    for (const int root : scenes[checked(number, scenes.size(), path_, "scene")].nodes)
      shown_[place_[checked(root, place_.size(), path_, "node")]] = true;
    for (size_t i = 0; i < order_.size(); ++i)
      if (const int p = parent_[order_[i]]; p >= 0 && shown_[place_[p]]) shown_[i] = true;
  }

  void read_node(size_t at) {
    const tinygltf::Node& in = model_.nodes[order_[at]];
    const std::string where = name_of("node", order_[at]);
    GltfNode node;
    node.name = in.name;
    node.number = static_cast<int>(order_[at]);
    if (const int p = parent_[order_[at]]; p >= 0) node.parent = place_[p];
    if (has_numbers(in.matrix, 16, path_, "the matrix of " + where)) decompose(in.matrix, node);
    if (has_numbers(in.translation, 3, path_, "the translation of " + where))
      node.translation = Vec3(in.translation.data());
    if (has_numbers(in.scale, 3, path_, "the scale of " + where))
      node.scale = Vec3(in.scale.data());
    if (has_numbers(in.rotation, 4, path_, "the rotation of " + where)) {
      const Quat q(in.rotation[3], in.rotation[0], in.rotation[1], in.rotation[2]);
      if (!(q.norm() > 1e-6)) broken(path_, "the rotation of " + where + " is none");
      node.rotation = q.normalized();
    }
    if (in.mesh >= 0 && shown_[at])
      wearers_.push_back({at, checked(in.mesh, model_.meshes.size(), path_, "mesh"), in.skin});
    out_.nodes.push_back(std::move(node));
  }

  // ---- skins ----

  void read_skin(size_t number) {
    const tinygltf::Skin& skin = model_.skins[number];
    const std::string where = name_of("skin", number);
    if (skin.joints.empty()) broken(path_, where + " has no joints");
    std::vector<float> inverse;
    if (skin.inverseBindMatrices >= 0) {
      inverse = gltf::read_floats(document_, skin.inverseBindMatrices, TINYGLTF_TYPE_MAT4,
                                  "inverse bind matrices of " + where, allowance_);
      if (inverse.size() < 16 * skin.joints.size())
        broken(path_, where + " has fewer inverse bind matrices than joints");
    }
    first_bone_.push_back(out_.bones.size());
    for (size_t j = 0; j < skin.joints.size(); ++j) {
      GltfBone bone;
      bone.node = place_[checked(skin.joints[j], place_.size(), path_, "node")];
      bone.skin = static_cast<int>(number);
      if (!inverse.empty()) {
        const Eigen::Map<const Eigen::Matrix4f> m(&inverse[16 * j]);
        bone.inverse_bind.matrix().topRows<3>() = m.topRows<3>().cast<double>();
        const double size = std::abs(bone.inverse_bind.linear().determinant());
        if (!(size > 1e-30) || m.cwiseAbs().maxCoeff() > kLargest)
          broken(path_, cat("inverse bind matrix ", j, " of ", where, " cannot be inverted"));
      }
      out_.bones.push_back(bone);
    }
    out_.skin_nodes.push_back(-1);
    allowance_.spend(skin.joints.size(), sizeof(GltfBone));
  }

  /// Nodes that are joints or hang below one.
  std::vector<bool> below_joints() const {
    std::vector<bool> out(out_.nodes.size());
    for (const GltfBone& bone : out_.bones) out[bone.node] = true;
    for (size_t n = 0; n < out.size(); ++n)
      if (const int p = out_.nodes[n].parent; p >= 0 && out[p]) out[n] = true;
    return out;
  }

  // ---- meshes ----

  void read_meshes() {
    out_.first_influence.push_back(0);
    const bool skins =
        std::any_of(wearers_.begin(), wearers_.end(), [](const Wearer& w) { return w.skin >= 0; });
    const std::vector<bool> rigid = below_joints();
    std::sort(wearers_.begin(), wearers_.end(), [&](const Wearer& a, const Wearer& b) {
      return order_[a.node] < order_[b.node];  // as in the file
    });
    for (const Wearer& wearer : wearers_) {
      if (wearer.skin >= 0) {
        const size_t skin = checked(wearer.skin, model_.skins.size(), path_, "skin");
        if (out_.skin_nodes[skin] < 0) out_.skin_nodes[skin] = static_cast<int>(wearer.node);
      } else if (skins && !rigid[wearer.node] && runs_ == nullptr) {
        if (loose_++ < 3) loose_names_.push_back(text::quote(out_.nodes[wearer.node].name));
        continue;
      }
      vertices_of_.clear();
      morphs_of_mesh_ = 0;
      const auto& primitives = model_.meshes[wearer.mesh].primitives;
      for (size_t p = 0; p < primitives.size(); ++p) read_primitive(wearer, primitives[p], p);
      ++out_.meshes;
      out_.morph_targets += morphs_of_mesh_;
    }
    if (out_.vertices.size() > static_cast<size_t>(INT32_MAX))
      broken(path_, "has more vertices than can be counted");
  }

  void read_primitive(const Wearer& wearer, const tinygltf::Primitive& primitive, size_t number) {
    const int mode = primitive.mode < 0 ? TINYGLTF_MODE_TRIANGLES : primitive.mode;
    if (mode == TINYGLTF_MODE_LINE || mode == TINYGLTF_MODE_LINE_LOOP ||
        mode == TINYGLTF_MODE_LINE_STRIP) {
      ++lines_;
      return;
    }
    const auto position = primitive.attributes.find("POSITION");
    if (position == primitive.attributes.end()) return;  // draws nothing
    morphs_of_mesh_ = std::max(morphs_of_mesh_, primitive.targets.size());
    const auto joints = primitive.attributes.find("JOINTS_0");
    const bool skinned = wearer.skin >= 0 && joints != primitive.attributes.end();
    // Primitives of a mesh often share one list of vertices and differ in their material. Those
    // that differ in texture coordinates share none if these are asked for.
    std::map<std::string, int> key = {*position};
    if (skinned) key.insert(*joints);
    if (runs_ != nullptr) key.insert(primitive.attributes.begin(), primitive.attributes.end());
    const auto [at, is_new] = vertices_of_.try_emplace(key, std::make_pair(size_t{0}, size_t{0}));
    const auto& [first, count] = at->second;
    if (is_new) at->second = read_vertices(wearer, primitive, position->second, skinned);
    out_.parts.push_back({out_.nodes[wearer.node].number, number, first, count});
    if (is_new && runs_ != nullptr)
      runs_->vertices.push_back({&primitive, static_cast<int>(wearer.node), first, count});
    const size_t faces = out_.faces.size();
    read_faces(primitive, mode, first, count);
    if (runs_ != nullptr) runs_->faces.push_back({&primitive, out_.faces.size() - faces});
  }

  /// First vertex and number of vertices.
  std::pair<size_t, size_t> read_vertices(const Wearer& wearer,
                                          const tinygltf::Primitive& primitive, int accessor,
                                          bool skinned) {
    const std::vector<float> xyz =
        gltf::read_floats(document_, accessor, TINYGLTF_TYPE_VEC3, "positions", allowance_);
    const size_t first = out_.vertices.size(), count = xyz.size() / 3;
    allowance_.spend(count, sizeof(Point) + sizeof(uint32_t));
    for (size_t v = 0; v < count; ++v) {
      const Point p(xyz[3 * v], xyz[3 * v + 1], xyz[3 * v + 2]);
      if (!(p.cwiseAbs().maxCoeff() < kLargest)) broken(path_, "a position is out of range");
      out_.vertices.push_back(p);
    }
    allowance_.spend(skinned ? 0 : count, sizeof(GltfInfluence));
    if (skinned) {
      read_influences(static_cast<size_t>(wearer.skin), primitive, count);
    } else {
      if (node_bone_.count(wearer.node) == 0) {
        node_bone_[wearer.node] = static_cast<int32_t>(out_.bones.size());
        out_.bones.push_back({static_cast<int>(wearer.node), -1, Eigen::Affine3d::Identity()});
      }
      for (size_t v = 0; v < count; ++v) {
        out_.influences.push_back({node_bone_[wearer.node], 1.0f});
        out_.first_influence.push_back(static_cast<uint32_t>(out_.influences.size()));
      }
    }
    return {first, count};
  }

  void read_influences(size_t skin, const tinygltf::Primitive& primitive, size_t count) {
    std::vector<std::vector<uint32_t>> joints;
    std::vector<std::vector<float>> weights;
    for (int set = 0; set < 4; ++set) {
      const auto j = primitive.attributes.find(cat("JOINTS_", set));
      const auto w = primitive.attributes.find(cat("WEIGHTS_", set));
      if (j == primitive.attributes.end() || w == primitive.attributes.end()) break;
      joints.push_back(
          gltf::read_integers(document_, j->second, TINYGLTF_TYPE_VEC4, "joints", allowance_));
      weights.push_back(
          gltf::read_floats(document_, w->second, TINYGLTF_TYPE_VEC4, "weights", allowance_));
      allowance_.spend(4 * count, sizeof(GltfInfluence));
      if (joints.back().size() != 4 * count || weights.back().size() != 4 * count)
        broken(path_, "has joints and weights for another number of vertices");
    }
    if (joints.empty()) broken(path_, "has skinned vertices without weights");
    const size_t limit = model_.skins[skin].joints.size();
    for (size_t v = 0; v < count; ++v) {
      const size_t first = out_.influences.size();
      double sum = 0;
      for (size_t set = 0; set < joints.size(); ++set)
        for (size_t k = 4 * v; k < 4 * v + 4; ++k) {
          const float weight = weights[set][k];
          if (weight == 0.0f) continue;
          if (!(weight > 0.0f && weight < 1e6f)) broken(path_, "has a weight out of range");
          const size_t joint = checked(joints[set][k], limit, path_, "joint");
          out_.influences.push_back({static_cast<int32_t>(first_bone_[skin] + joint), weight});
          sum += weight;
        }
      if (sum <= 0) {
        ++weightless_;
        out_.influences.push_back({static_cast<int32_t>(first_bone_[skin]), 1.0f});
        sum = 1;
      }
      for (size_t i = first; i < out_.influences.size(); ++i)
        out_.influences[i].weight = static_cast<float>(out_.influences[i].weight / sum);
      if (out_.influences.size() > UINT32_MAX) broken(path_, "has too many weights");
      out_.first_influence.push_back(static_cast<uint32_t>(out_.influences.size()));
    }
  }

  void read_faces(const tinygltf::Primitive& primitive, int mode, size_t first, size_t count) {
    if (mode == TINYGLTF_MODE_POINTS) return;
    std::vector<uint32_t> index;
    if (primitive.indices >= 0) {
      index = gltf::read_integers(document_, primitive.indices, TINYGLTF_TYPE_SCALAR, "indices",
                                  allowance_);
      for (const uint32_t i : index) checked(i, count, path_, "vertex");
    } else {
      allowance_.spend(count, sizeof(uint32_t));
      for (size_t i = 0; i < count; ++i) index.push_back(static_cast<uint32_t>(i));
    }
    allowance_.spend(index.size(), (mode == TINYGLTF_MODE_TRIANGLES ? 1 : 3) * sizeof(uint32_t));
    const auto add = [&](size_t a, size_t b, size_t c) {
      out_.faces.push_back({static_cast<int32_t>(first + index[a]),
                            static_cast<int32_t>(first + index[b]),
                            static_cast<int32_t>(first + index[c])});
    };
    if (mode == TINYGLTF_MODE_TRIANGLES) {
      if (index.size() % 3 != 0) broken(path_, "has triangles without a third corner");
      for (size_t i = 0; i + 2 < index.size(); i += 3) add(i, i + 1, i + 2);
    } else if (mode == TINYGLTF_MODE_TRIANGLE_STRIP) {
      for (size_t i = 0; i + 2 < index.size(); ++i)
        i % 2 == 0 ? add(i, i + 1, i + 2) : add(i + 1, i, i + 2);
    } else if (mode == TINYGLTF_MODE_TRIANGLE_FAN) {
      for (size_t i = 1; i + 1 < index.size(); ++i) add(0, i, i + 1);
    } else {
      broken(path_, cat("has a mesh of the unknown kind ", mode));
    }
  }

  // ---- animations ----

  /// Key times of an accessor, read once.
  int times_of(int accessor) {
    const auto known = times_.find(accessor);
    if (known != times_.end()) return known->second;
    std::vector<float> times =
        gltf::read_floats(document_, accessor, TINYGLTF_TYPE_SCALAR, "key times", allowance_);
    for (size_t k = 1; k < times.size(); ++k)
      if (times[k] < times[k - 1]) broken(path_, "has key times that fall");
    out_.times.push_back(std::move(times));
    return times_[accessor] = static_cast<int>(out_.times.size()) - 1;
  }

  void read_animation(size_t number) {
    const tinygltf::Animation& animation = model_.animations[number];
    GltfClip clip;
    clip.name = animation.name.empty() ? name_of("animation", number) : animation.name;
    bool weights = false;
    for (const tinygltf::AnimationChannel& channel : animation.channels) {
      const std::string& path = channel.target_path;
      if (channel.target_node < 0) continue;  // aims at nothing
      if (path == "weights") {                // a face's, which rests as it is modelled
        weights = true;
        continue;
      }
      if (path != "translation" && path != "rotation" && path != "scale") {
        ++unknown_tracks_;
        continue;
      }
      clip.tracks.push_back(read_track(animation, channel, clip.name));
    }
    if (clip.tracks.empty() && !(weights && runs_ != nullptr)) return;
    if (runs_ != nullptr) runs_->animations.push_back(number);
    clip.begin = INFINITY, clip.end = -INFINITY;
    for (const GltfTrack& track : clip.tracks) {
      const auto& times = out_.times[track.times];
      clip.begin = std::min(clip.begin, static_cast<double>(times.front()));
      clip.end = std::max(clip.end, static_cast<double>(times.back()));
    }
    out_.clips.push_back(std::move(clip));
  }

  GltfTrack read_track(const tinygltf::Animation& animation,
                       const tinygltf::AnimationChannel& channel, const std::string& clip) {
    const auto& sampler =
        animation.samplers[checked(channel.sampler, animation.samplers.size(), path_, "sampler")];
    GltfTrack track;
    track.node = place_[checked(channel.target_node, place_.size(), path_, "node")];
    const bool turns = channel.target_path == "rotation";
    track.path = turns                            ? GltfTrack::Path::rotation
                 : channel.target_path == "scale" ? GltfTrack::Path::scale
                                                  : GltfTrack::Path::translation;
    if (sampler.interpolation == "CUBICSPLINE")
      track.interpolation = GltfTrack::Interpolation::cubic;
    else if (sampler.interpolation == "STEP")
      track.interpolation = GltfTrack::Interpolation::step;
    else if (sampler.interpolation != "LINEAR" && !sampler.interpolation.empty())
      broken(path_, "clip " + text::quote(clip) + " is interpolated in an unknown way");
    track.times = times_of(sampler.input);
    track.values = gltf::read_floats(document_, sampler.output,
                                     turns ? TINYGLTF_TYPE_VEC4 : TINYGLTF_TYPE_VEC3, "key values",
                                     allowance_);
    const size_t keys = out_.times[track.times].size();
    const size_t wanted =
        keys * (turns ? 4 : 3) * (track.interpolation == GltfTrack::Interpolation::cubic ? 3 : 1);
    if (track.values.size() != wanted)
      broken(path_, "clip " + text::quote(clip) + " has keys without values");
    for (const float x : track.values)
      if (!(std::abs(x) < kLargest)) broken(path_, "a key of an animation is out of range");
    return track;
  }

  void report() {
    if (loose_ > 0)
      out_.remarks.push_back(cat("left out ", loose_, " meshes that belong to no skin: ",
                                 joined(loose_names_), loose_ > 3 ? ", ..." : ""));
    if (lines_ > 0) out_.remarks.push_back("left out lines: only points and triangles are read");
    if (weightless_ > 0)
      out_.remarks.push_back(
          cat(weightless_, " vertices without weights hang on the first joint of their skin"));
    if (unknown_tracks_ > 0)
      out_.remarks.push_back(
          cat("left out ", unknown_tracks_,
              " animated properties other than translation, rotation and scale"));
  }

  const Document& document_;
  const tinygltf::Model& model_;
  const std::string& path_;
  Allowance& allowance_;
  gltf::Runs* runs_;  // null: not asked for
  Gltf out_;
  std::vector<size_t> order_;  // file numbers of nodes, parents first
  std::vector<int> place_;     // of a file number in order_
  std::vector<int> parent_;    // file number to file number
  std::vector<bool> shown_;    // by place
  std::vector<Wearer> wearers_;
  std::vector<size_t> first_bone_;  // of each skin
  std::map<std::map<std::string, int>, std::pair<size_t, size_t>> vertices_of_;
  std::map<size_t, int32_t> node_bone_;
  std::map<int, int> times_;
  size_t lines_ = 0, loose_ = 0, weightless_ = 0, unknown_tracks_ = 0;
  std::vector<std::string> loose_names_;
  size_t morphs_of_mesh_ = 0;
};

}  // namespace

Gltf gltf::build(const Document& document, Allowance& allowance, Runs* runs) {
  return Builder(document, allowance, runs).build();
}

bool is_gltf_name(const std::string& path) {
  return text::ends_in(path, {".glb", ".gltf", ".vrm", ".vrma"}) || is_fbx_name(path);
}

Gltf parse_gltf(std::string_view content, const std::string& path) {
  if (is_fbx_name(path)) refuse_foreign_content(content, path);
  std::vector<std::string> remarks;
  std::string made;
  if (is_fbx_name(path)) content = made = fbx_as_glb(content, path, &remarks);
  const Document document = gltf::parse_document(content, path);
  Allowance allowance(document.payload, path);
  Gltf out = gltf::build(document, allowance);
  out.remarks.insert(out.remarks.begin(), remarks.begin(), remarks.end());
  return out;
}

std::string read_gltf_bytes(const std::string& path, std::vector<std::string>* remarks) {
  std::string content = read_file(path);
  if (!is_fbx_name(path)) return content;
  refuse_foreign_content(content, path);
  return fbx_as_glb(content, path, remarks);
}

Gltf read_gltf(const std::string& path) { return parse_gltf(read_file(path), path); }

}  // namespace restage
