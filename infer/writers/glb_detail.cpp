#include "infer/writers/glb_detail.h"

#include <algorithm>
#include <cmath>

namespace restage::glb {
namespace {

Json node(const std::string& name, const Vec3& translation, const Mat3& rotation) {
  Json out = {{"name", name}, {"translation", three(translation.cast<float>())}};
  if (rotation.isIdentity(1e-12)) return out;
  const Eigen::Vector4f q = Quat(rotation).normalized().coeffs().cast<float>();
  out["rotation"] = {q[0], q[1], q[2], q[3]};
  return out;
}

}  // namespace

std::vector<float> three(const Eigen::Vector3f& p) { return {p.x(), p.y(), p.z()}; }

int Buffer::add(const void* data, size_t bytes, size_t count, Component component, const char* type,
                Target target) {
  Json view = {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", bytes}};
  if (target != none) view["target"] = static_cast<int>(target);
  views_.push_back(view);
  bytes_.append(static_cast<const char*>(data), bytes);
  bytes_.resize((bytes_.size() + 3) / 4 * 4, '\0');
  accessors_.push_back({{"bufferView", views_.size() - 1},
                        {"componentType", static_cast<int>(component)},
                        {"count", count},
                        {"type", type}});
  return static_cast<int>(accessors_.size()) - 1;
}

int Buffer::add_bytes(const void* data, size_t count) {
  const int accessor = add(data, count * 4, count, i8, "VEC3", vertices);
  views_.back()["byteStride"] = 4;
  accessors_.back()["normalized"] = true;
  return accessor;
}

int Buffer::add_bytes(const void* data, size_t count, const std::array<int, 3>& low,
                      const std::array<int, 3>& high) {
  const int accessor = add_bytes(data, count);
  accessors_.back()["min"] = low;
  accessors_.back()["max"] = high;
  return accessor;
}

void Buffer::set_bounds(int accessor, const std::vector<float>& low,
                        const std::vector<float>& high) {
  accessors_[accessor]["min"] = low;
  accessors_[accessor]["max"] = high;
}

void Buffer::describe(Json& root) const {
  root["buffers"] = Json::array({{{"byteLength", bytes_.size()}}});
  root["bufferViews"] = views_;
  root["accessors"] = accessors_;
}

Json nodes(const Joints& rest, const RigConvention& rig) {
  Json list = Json::array();
  for (size_t j = 0; j < kJoints; ++j) {
    const auto p = static_cast<size_t>(std::max(kParents[j], 0));
    const Vec3 offset = j == 0 ? rest[0] : Vec3(rig.axes[p].transpose() * Vec3(rest[j] - rest[p]));
    Json item = node(rig.names[j], offset, in_axes(rig, j, Mat3::Identity()));
    for (size_t child = j + 1; child < kJoints; ++child)
      if (kParents[child] == static_cast<int>(j)) item["children"].push_back(child);
    list.push_back(item);
  }
  for (const ExtraNode& extra : rig.extra) {
    const auto p = static_cast<size_t>(extra.parent);
    list[p]["children"].push_back(list.size());
    list.push_back(
        node(extra.name, rig.axes[p].transpose() * (extra.place - rest[p]), Mat3::Identity()));
  }
  if (!rig.root.empty()) list.push_back({{"name", rig.root}, {"children", {0}}});
  return list;
}

int top_node(const RigConvention& rig) {
  return rig.root.empty() ? 0 : kJoints + static_cast<int>(rig.extra.size());
}

Joints placed_joints(const Json& nodes, const RigConvention& rig) {
  Joints out;
  for (size_t j = 0; j < kJoints; ++j) {
    const Json& at = nodes[j]["translation"];
    const Vec3 offset(double{at[0].get<float>()}, double{at[1].get<float>()},
                      double{at[2].get<float>()});
    const auto p = static_cast<size_t>(std::max(kParents[j], 0));
    out[j] = j == 0 ? offset : Vec3(out[p] + rig.axes[p] * offset);
  }
  return out;
}

void add_morphs(Buffer& buffer, const GlbMorphs& morphs, size_t frames, size_t node, Json& root) {
  if (morphs.deltas.empty()) return;
  Json& primitive = root["meshes"][0]["primitives"][0];
  Json names = Json::array();
  for (const std::vector<int8_t>& delta : morphs.deltas) {
    const size_t count = delta.size() / 3;
    // Of four bytes each, as the format wants.
    std::vector<std::array<int8_t, 4>> rows(count);
    std::array<int, 3> low{127, 127, 127}, high{-127, -127, -127};
    for (size_t i = 0; i < delta.size(); ++i) {
      rows[i / 3][i % 3] = delta[i];
      low[i % 3] = std::min<int>(low[i % 3], delta[i]);
      high[i % 3] = std::max<int>(high[i % 3], delta[i]);
    }
    const int at = buffer.add_bytes(rows.data(), count, low, high);
    primitive["targets"].push_back({{"POSITION", at}});
    names.push_back("surface_" + std::to_string(names.size() + 1));
  }
  const size_t targets = morphs.deltas.size();
  root["meshes"][0]["weights"] = std::vector<float>(targets, 0.0f);
  root["meshes"][0]["extras"] = {{"targetNames", names}};
  root["extensionsUsed"] = root["extensionsRequired"] = Json::array({"KHR_mesh_quantization"});
  if (frames == 0) return;
  const auto& weights = morphs.weights;
  const bool whole =
      std::all_of(weights.begin(), weights.end(), [](float w) { return std::abs(w) <= 1; });
  std::vector<int16_t> steps;
  for (const float w : weights)
    if (whole) steps.push_back(static_cast<int16_t>(std::lround(32767 * w)));
  const int output =
      whole ? buffer.add(steps.data(), 2 * steps.size(), steps.size(), i16, "SCALAR", none)
            : buffer.add(weights.data(), 4 * weights.size(), weights.size(), f32, "SCALAR", none);
  if (whole) buffer.set_normalized(output);
  Json& animation = root["animations"][0];
  animation["channels"].push_back({{"sampler", animation["samplers"].size()},
                                   {"target", {{"node", node}, {"path", "weights"}}}});
  animation["samplers"].push_back({{"input", animation["samplers"][0]["input"]},
                                   {"interpolation", "LINEAR"},
                                   {"output", output}});
}

Json animation(Buffer& buffer, const Tracks& tracks, const std::string& name, double fps,
               bool small) {
  const size_t frames = tracks.frames();
  std::vector<float> times(frames);
  for (size_t f = 0; f < times.size(); ++f)
    times[f] = static_cast<float>(static_cast<double>(f) / fps);
  const int input = buffer.add(times.data(), times.size() * 4, times.size(), f32, "SCALAR", none);
  buffer.set_bounds(input, {times.front()}, {times.back()});
  Json samplers = Json::array(), channels = Json::array();
  const auto channel = [&](size_t at, const char* path, int output) {
    channels.push_back({{"sampler", samplers.size()}, {"target", {{"node", at}, {"path", path}}}});
    samplers.push_back({{"input", input}, {"interpolation", "LINEAR"}, {"output", output}});
  };
  channel(0, "translation",
          buffer.add(tracks.roots().data(), frames * 12, frames, f32, "VEC3", none));
  std::vector<std::array<float, 4>> track(frames);
  std::vector<std::array<int16_t, 4>> steps(frames);
  for (size_t j = 0; j < kJoints; ++j) {
    for (size_t f = 0; f < frames; ++f) {
      track[f] = tracks.turns()[f * kJoints + j];
      for (size_t k = 0; k < 4; ++k)
        steps[f][k] = static_cast<int16_t>(std::lround(32767 * track[f][k]));
    }
    if (!small) {
      channel(j, "rotation", buffer.add(track.data(), frames * 16, frames, f32, "VEC4", none));
      continue;
    }
    const int output = buffer.add(steps.data(), frames * 8, frames, i16, "VEC4", none);
    buffer.set_normalized(output);
    channel(j, "rotation", output);
  }
  return {{"name", name}, {"channels", channels}, {"samplers", samplers}};
}

}  // namespace restage::glb
