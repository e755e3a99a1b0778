// Animations. Assimp animates either a whole node or the parts that a node is a product of
// (fbx_detail.h, Node::chain); glTF gets the product, at the times at which one of the parts has a
// key.
#include <algorithm>
#include <cmath>
#include <set>

#include "datasets/readers/fbx/assimp/fbx_detail.h"
#include "datasets/readers/text/text.h"

namespace restage::fbx {
namespace {

using Eigen::Matrix4d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

/// The place between keys k and k + 1 at a time; held before the first and after the last.
template <class Key>
std::pair<unsigned, double> place_of(const Key* keys, unsigned count, double time) {
  const Key* after = std::upper_bound(keys, keys + count, time,
                                      [](double t, const Key& key) { return t < key.mTime; });
  if (after == keys) return {0, 0};
  const auto k = static_cast<unsigned>(after - keys) - 1;
  if (k + 1 >= count) return {k, 0};
  const double span = keys[k + 1].mTime - keys[k].mTime;
  return {k, span > 0 ? (time - keys[k].mTime) / span : 0};
}

Vector3d value_at(const aiVectorKey* keys, unsigned count, double time, const Vector3d& otherwise) {
  if (count == 0) return otherwise;
  const auto [k, part] = place_of(keys, count, time);
  const auto at = [&](unsigned i) {
    return Vector3d(keys[i].mValue.x, keys[i].mValue.y, keys[i].mValue.z);
  };
  return part > 0 ? Vector3d((1 - part) * at(k) + part * at(k + 1)) : at(k);
}

Quaterniond value_at(const aiQuatKey* keys, unsigned count, double time) {
  if (count == 0) return Quaterniond::Identity();
  const auto [k, part] = place_of(keys, count, time);
  const auto at = [&](unsigned i) {
    const aiQuaternion& q = keys[i].mValue;
    return Quaterniond(q.w, q.x, q.y, q.z).normalized();
  };
  return part > 0 ? at(k).slerp(part, at(k + 1)) : at(k);
}

Matrix4d matrix_at(const aiNodeAnim& c, double time, const Quaterniond& after) {
  Eigen::Affine3d out;
  out.fromPositionOrientationScale(
      value_at(c.mPositionKeys, c.mNumPositionKeys, time, Vector3d::Zero()),
      value_at(c.mRotationKeys, c.mNumRotationKeys, time) * after,
      value_at(c.mScalingKeys, c.mNumScalingKeys, time, Vector3d::Ones()));
  return out.matrix();
}

/// Parts that do not move have one key at a time of their own, which counts only if there are no
/// others.
template <class Key>
void collect(const Key* keys, unsigned count, std::set<double>& moving, std::set<double>& single) {
  for (unsigned k = 0; k < count; ++k) (count > 1 ? moving : single).insert(keys[k].mTime);
}

/// How a node moves: its own channel, or those of its parts.
struct Motion {
  const aiNodeAnim* whole = nullptr;
  Quaterniond after = Quaterniond::Identity();  ///< of `whole`, on the right of its rotations
  std::vector<const aiNodeAnim*> parts;         ///< of Node::chain; nullptr: at rest

  Matrix4d at(const Node& node, double time) const {
    if (whole != nullptr) return matrix_at(*whole, time, after);
    Matrix4d out = Matrix4d::Identity();
    for (size_t i = 0; i < parts.size(); ++i)
      out = out * (parts[i] != nullptr ? matrix_at(*parts[i], time, Quaterniond::Identity())
                                       : matrix_of(node.chain[i]->mTransformation));
    return out;
  }
  std::vector<double> times() const {
    std::set<double> moving, single;
    std::vector<const aiNodeAnim*> all = parts;
    all.push_back(whole);
    for (const aiNodeAnim* c : all) {
      if (c == nullptr) continue;
      collect(c->mPositionKeys, c->mNumPositionKeys, moving, single);
      collect(c->mRotationKeys, c->mNumRotationKeys, moving, single);
      collect(c->mScalingKeys, c->mNumScalingKeys, moving, single);
    }
    if (moving.empty() && !single.empty()) moving.insert(*single.begin());
    return {moving.begin(), moving.end()};
  }
};

using Channels = std::map<std::string, const aiNodeAnim*>;

Motion motion_of(const Node& node, const Channels& channels) {
  Motion out;
  const auto find = [&](const std::string& name) {
    const auto at = channels.find(name);
    return at == channels.end() ? nullptr : at->second;
  };
  // A channel of the node itself is of all its parts.
  out.whole = find(node.raw);
  for (const aiNode* part : node.chain) {
    const std::string name = part->mName.C_Str();
    if (out.whole == nullptr) out.parts.push_back(find(name));
    // Assimp 5.2 puts the rotation that FBX takes back (PostRotation) behind such a channel
    // instead: twice its inverse, which the part has, mends that.
    if (out.whole != nullptr && name.ends_with("_PostRotation")) {
      const Quaterniond inverse = trs_of(matrix_of(part->mTransformation)).rotation;
      out.after = inverse * inverse;
    }
  }
  return out;
}

}  // namespace

int Maker::add_times(const std::vector<double>& seconds) {
  std::vector<float> times;
  times.reserve(seconds.size());
  for (const double t : seconds) times.push_back(static_cast<float>(t));
  const int out = add(times, kFloat, "SCALAR", 1);
  set_bounds(out, times, 1);
  return out;
}

void Maker::add_channel(Json& out, int node, const char* path, int input, int output) const {
  out["channels"].push_back(
      {{"sampler", out["samplers"].size()}, {"target", {{"node", node}, {"path", path}}}});
  out["samplers"].push_back({{"input", input}, {"interpolation", "LINEAR"}, {"output", output}});
}

namespace {

/// Keys in seconds from the begin, each once in single precision; and the scene's times of those.
void to_seconds(double ticks, std::vector<double>& times, std::vector<double>& seconds) {
  std::vector<double> kept;
  for (const double t : times) {
    const double s = std::max(0.0, t / ticks);
    if (!std::isfinite(s) || s > 1e7) continue;
    if (!seconds.empty() && static_cast<float>(s) <= static_cast<float>(seconds.back())) continue;
    kept.push_back(t);
    seconds.push_back(s);
  }
  times = std::move(kept);
}

double ticks_of(const aiAnimation& animation) {
  return animation.mTicksPerSecond != 0 ? animation.mTicksPerSecond : 1;
}

}  // namespace

void Maker::add_turns(const aiAnimation& animation, Json& out) {
  Channels channels;
  for (unsigned c = 0; c < animation.mNumChannels; ++c)
    channels.emplace(animation.mChannels[c]->mNodeName.C_Str(), animation.mChannels[c]);
  std::map<std::vector<double>, int> inputs;  // most nodes have their keys at the same times
  for (size_t n = 1; n < nodes_.size(); ++n) {
    const Node& node = nodes_[n];
    const Motion motion = motion_of(node, channels);
    std::vector<double> times = motion.times(), seconds;
    to_seconds(ticks_of(animation), times, seconds);
    if (times.empty()) continue;
    const Trs rest = trs_of(node.local);
    std::vector<float> places, turns, scales;
    bool moved = false, turned = false, scaled = false;
    Quaterniond before = rest.rotation;
    for (const double time : times) {
      Trs now = trs_of(motion.at(node, time));
      if (now.rotation.dot(before) < 0) now.rotation.coeffs() *= -1;
      before = now.rotation;
      moved = moved || !now.translation.isApprox(rest.translation, 1e-6);
      turned = turned || now.rotation.angularDistance(rest.rotation) > 1e-5;
      scaled = scaled || !now.scale.isApprox(rest.scale, 1e-5);
      for (int k = 0; k < 3; ++k) places.push_back(static_cast<float>(now.translation[k]));
      for (int k = 0; k < 4; ++k) turns.push_back(static_cast<float>(now.rotation.coeffs()[k]));
      for (int k = 0; k < 3; ++k) scales.push_back(static_cast<float>(now.scale[k]));
    }
    if (!moved && !turned && !scaled) continue;
    const auto [at, is_new] = inputs.try_emplace(seconds, 0);
    if (is_new) at->second = add_times(seconds);
    const int number = static_cast<int>(n);
    if (moved) add_channel(out, number, "translation", at->second, add(places, kFloat, "VEC3", 3));
    if (turned) add_channel(out, number, "rotation", at->second, add(turns, kFloat, "VEC4", 4));
    if (scaled) add_channel(out, number, "scale", at->second, add(scales, kFloat, "VEC3", 3));
  }
}

/// Morph targets: a channel is called after a node and the place of its mesh there ("Body*0"), and
/// a key holds only the weights that have a key at its time.
void Maker::add_weights(const aiAnimation& animation, Json& out) {
  for (unsigned c = 0; c < animation.mNumMorphMeshChannels; ++c) {
    const aiMeshMorphAnim& channel = *animation.mMorphMeshChannels[c];
    const std::string name = channel.mName.C_Str();
    const std::string owner = name.substr(0, name.rfind('*'));
    const auto node = std::find_if(nodes_.begin(), nodes_.end(), [&](const Node& one) {
      return one.raw == owner && one.targets > 0;
    });
    if (node == nodes_.end()) continue;
    std::vector<std::vector<aiVectorKey>> of_target(node->targets);
    std::set<double> all;
    for (unsigned k = 0; k < channel.mNumKeys; ++k) {
      const aiMeshMorphKey& key = channel.mKeys[k];
      for (unsigned i = 0; i < key.mNumValuesAndWeights; ++i)
        if (key.mValues[i] < node->targets) {
          const auto weight = static_cast<ai_real>(key.mWeights[i]);
          of_target[key.mValues[i]].emplace_back(key.mTime, aiVector3D(weight, 0, 0));
          all.insert(key.mTime);
        }
    }
    std::vector<double> times(all.begin(), all.end()), seconds;
    to_seconds(ticks_of(animation), times, seconds);
    if (times.empty()) continue;
    std::vector<float> values;
    for (const double time : times)
      for (const std::vector<aiVectorKey>& keys : of_target)
        values.push_back(static_cast<float>(
            value_at(keys.data(), static_cast<unsigned>(keys.size()), time, Vector3d::Zero()).x()));
    add_channel(out, node->wearer, "weights", add_times(seconds), add(values, kFloat, "SCALAR", 1));
  }
}

void Maker::add_animations() {
  for (unsigned a = 0; a < scene_.mNumAnimations; ++a) {
    const aiAnimation& animation = *scene_.mAnimations[a];
    const char* name = animation.mName.C_Str();
    Json item = {{"name", text::is_utf8(name) ? std::string(name) : "animation"},
                 {"channels", Json::array()},
                 {"samplers", Json::array()}};
    add_turns(animation, item);
    add_weights(animation, item);
    if (!item["channels"].empty()) json_["animations"].push_back(std::move(item));
  }
}

}  // namespace restage::fbx
