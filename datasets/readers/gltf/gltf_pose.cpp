// Where nodes and vertices are: hierarchy, key frames, linear blend skinning.
#include <algorithm>
#include <cmath>

#include "datasets/readers/errors.h"
#include "datasets/readers/gltf/gltf_blends.h"
#include "datasets/readers/gltf/gltf_look.h"
#include "datasets/readers/text/text.h"

namespace restage {
namespace {

using Path = GltfTrack::Path;
using Interpolation = GltfTrack::Interpolation;

/// The keys about a time: `t` of the way from `a` to `b`, which are `seconds` apart.
struct Between {
  size_t a, b;
  double t, seconds;
};

/// A key counts as reached a hair before its time: 1/30 s as a float is not 1/30 s, and a STEP
/// track (or two keys at one time) would be a frame late. 0.1 ms is well below any frame.
Between find_keys(const std::vector<float>& times, double seconds) {
  const double reached = seconds + 1e-4 + std::abs(seconds) * 1.2e-7;
  const auto after = std::upper_bound(times.begin(), times.end(), reached,
                                      [](double s, float key) { return s < double{key}; });
  const auto b = static_cast<size_t>(after - times.begin());
  if (b == 0) return {0, 0, 0, 0};
  if (b == times.size()) return {b - 1, b - 1, 0, 0};
  const double from = double{times[b - 1]}, span = double{times[b]} - from;
  return {b - 1, b, span > 0 ? std::max(0.0, (seconds - from) / span) : 0, span};
}

/// One key's value; `part` 0 in-tangent, 1 value, 2 out-tangent of a cubic track.
Eigen::Vector4d key(const GltfTrack& track, size_t k, size_t part) {
  const size_t width = track.path == Path::rotation ? 4 : 3;
  const size_t at = track.interpolation == Interpolation::cubic ? 3 * k + part : k;
  Eigen::Vector4d out = Eigen::Vector4d::Zero();
  for (size_t c = 0; c < width; ++c) out[c] = track.values[at * width + c];
  return out;
}

Quat unit(const Eigen::Vector4d& xyzw) {
  const double norm = xyzw.norm();
  return norm > 1e-9 ? Quat(Eigen::Vector4d(xyzw / norm)) : Quat::Identity();
}

/// The format's appendix C.
Eigen::Vector4d value_at(const GltfTrack& track, const Between& at) {
  if (at.a == at.b || track.interpolation == Interpolation::step) return key(track, at.a, 1);
  const double t = at.t;
  if (track.interpolation == Interpolation::cubic) {
    const double t2 = t * t, t3 = t2 * t;
    return (2 * t3 - 3 * t2 + 1) * key(track, at.a, 1) +
           at.seconds * (t3 - 2 * t2 + t) * key(track, at.a, 2) +
           (3 * t2 - 2 * t3) * key(track, at.b, 1) + at.seconds * (t3 - t2) * key(track, at.b, 0);
  }
  if (track.path == Path::rotation)
    return unit(key(track, at.a, 1)).slerp(t, unit(key(track, at.b, 1))).coeffs();
  return (1 - t) * key(track, at.a, 1) + t * key(track, at.b, 1);
}

GltfTransforms to_world(const std::vector<GltfNode>& nodes) {
  GltfTransforms out(nodes.size());
  for (size_t n = 0; n < nodes.size(); ++n) {
    const int p = nodes[n].parent;
    out[n] = p < 0 ? nodes[n].local() : out[p] * nodes[n].local();
  }
  return out;
}

/// Linear blend skinning of `vertices`, which may be the file's or others in their place.
Points skinned(const Gltf& file, const Points& vertices, const GltfTransforms& nodes) {
  using Rows = Eigen::Matrix<double, 3, 4>;
  std::vector<Rows> bones;
  bones.reserve(file.bones.size());
  for (const GltfBone& bone : file.bones)
    bones.push_back((nodes[bone.node] * bone.inverse_bind).affine());
  Points out(vertices.size());
  for (size_t v = 0; v < out.size(); ++v) {
    Rows sum = Rows::Zero();
    for (uint32_t i = file.first_influence[v]; i < file.first_influence[v + 1]; ++i)
      sum += double{file.influences[i].weight} * bones[file.influences[i].bone];
    const Eigen::Vector4d at = vertices[v].cast<double>().homogeneous();
    out[v] = (sum * at).cast<float>();
    if (!out[v].allFinite())
      throw InputError(file.path, cat("its transforms put vertex ", v, " nowhere"),
                       "export it again with finite scales");
  }
  return out;
}

/// A mirror turns a surface inside out: triangles whose bones mirror are turned round.
void keep_outside_out(const Gltf& file, const GltfTransforms& nodes, std::vector<Triangle>& faces) {
  std::vector<bool> mirrors;
  for (const GltfBone& bone : file.bones)
    mirrors.push_back((nodes[bone.node] * bone.inverse_bind).linear().determinant() < 0);
  if (std::find(mirrors.begin(), mirrors.end(), true) == mirrors.end()) return;
  for (Triangle& face : faces) {
    const uint32_t first = file.first_influence[face[0]];
    if (mirrors[file.influences[first].bone]) std::swap(face[1], face[2]);
  }
}

Mesh posed_mesh(const Gltf& file, const Points& vertices, const GltfTransforms& nodes) {
  Mesh out{skinned(file, vertices, nodes), file.faces};
  keep_outside_out(file, nodes, out.faces);
  return out;
}

/// Weights of a node's morph targets at a time of a clip, or at rest.
std::vector<float> weights_at(const GltfLook& look, int node, const GltfClip* clip,
                              double seconds) {
  std::vector<float> out = look.weights[node];
  if (clip == nullptr) return out;
  for (const GltfWeightTrack& track : look.weight_tracks[clip - look.file.clips.data()]) {
    if (track.node != node) continue;
    const Between at = find_keys(look.file.times[track.times], seconds);
    const bool cubic = track.interpolation == Interpolation::cubic;
    const double t = track.interpolation == Interpolation::step ? 0 : at.t;
    const double t2 = t * t, t3 = t2 * t;
    out.resize(track.targets);
    for (size_t k = 0; k < track.targets; ++k) {
      const auto value = [&](size_t keyed, size_t part) {
        return double{track.values[(cubic ? 3 * keyed + part : keyed) * track.targets + k]};
      };
      out[k] = static_cast<float>(cubic ? (2 * t3 - 3 * t2 + 1) * value(at.a, 1) +
                                              at.seconds * (t3 - 2 * t2 + t) * value(at.a, 2) +
                                              (3 * t2 - 2 * t3) * value(at.b, 1) +
                                              at.seconds * (t3 - t2) * value(at.b, 0)
                                        : (1 - t) * value(at.a, 1) + t * value(at.b, 1));
    }
  }
  return out;
}

}  // namespace

GltfTransforms gltf_rest(const Gltf& file) { return to_world(file.nodes); }

GltfTransforms gltf_pose(const Gltf& file, const GltfClip& clip, double seconds) {
  std::vector<GltfNode> nodes = file.nodes;
  for (const GltfTrack& track : clip.tracks) {
    const auto& times = file.times[track.times];
    const Eigen::Vector4d value = value_at(track, find_keys(times, seconds));
    GltfNode& node = nodes[track.node];
    if (track.path == Path::rotation) node.rotation = unit(value);
    if (track.path == Path::translation) node.translation = value.head<3>();
    if (track.path == Path::scale) node.scale = value.head<3>();
  }
  return to_world(nodes);
}

Mesh gltf_mesh(const Gltf& file, const GltfTransforms& nodes) {
  if (file.vertices.empty())
    throw InputError(file.path, "holds no mesh", "export the character with its mesh");
  return posed_mesh(file, file.vertices, nodes);
}

std::vector<Mat3> gltf_blends(const Gltf& file, const GltfTransforms& nodes) {
  std::vector<Mat3> bones, out;
  for (const GltfBone& bone : file.bones)
    bones.emplace_back((nodes[bone.node] * bone.inverse_bind).linear());
  for (size_t v = 0; v + 1 < file.first_influence.size(); ++v) {
    Mat3& sum = out.emplace_back(Mat3::Zero());
    for (uint32_t i = file.first_influence[v]; i < file.first_influence[v + 1]; ++i)
      sum +=
          double{file.influences[i].weight} * bones[static_cast<size_t>(file.influences[i].bone)];
  }
  return out;
}

Mesh gltf_look_mesh(const GltfLook& look, const GltfTransforms& nodes, const GltfClip* clip,
                    double seconds) {
  Points vertices = look.file.vertices;
  for (const GltfMorphs& morphs : look.morphs) {
    const std::vector<float> weights = weights_at(look, morphs.node, clip, seconds);
    for (size_t t = 0; t < std::min(weights.size(), morphs.targets.size()); ++t)
      if (weights[t] != 0)
        for (size_t v = 0; v < morphs.targets[t].size(); ++v)
          vertices[morphs.first + v] += weights[t] * morphs.targets[t][v];
  }
  return posed_mesh(look.file, vertices, nodes);
}

const GltfClip& find_clip(const Gltf& file, const std::string& name) {
  if (file.clips.empty()) throw InputError(file.path, "holds no animation", "export it with one");
  if (name.empty()) return file.clips.front();
  for (const GltfClip& clip : file.clips)
    if (clip.name == name) return clip;
  throw InputError(file.path, "holds no clip " + text::quote(name),
                   "name one of " + cut_list(file.clips, 120, [](const GltfClip& clip) {
                     return text::quote(clip.name);
                   }));
}

int64_t clip_frames(const Gltf& file, const GltfClip& clip) {
  constexpr double kLongest = 9 * 3600;
  const double seconds = clip.end - clip.begin;
  if (!(seconds <= kLongest))
    throw InputError(file.path, "clip " + text::quote(clip.name) + " lasts longer than 9 hours",
                     "cut it into shorter ones");
  return static_cast<int64_t>(std::floor(seconds * kFps + 1e-3)) + 1;
}

}  // namespace restage
