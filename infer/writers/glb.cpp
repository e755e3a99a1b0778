#include "infer/writers/glb.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "infer/writers/glb_detail.h"
#include "nn/geometry/glb_file.h"
#include "nn/geometry/mesh_file.h"
#include "nn/geometry/normals.h"

namespace restage {
namespace {

using glb::Buffer;
using glb::Json;
using glb::three;

constexpr float kNegligible = 1e-6f;  // a joint with a smaller weight is left out

/// The largest weight is what the others leave over, so that all sum to 1.
std::vector<std::array<uint16_t, 4>> short_weights(const Influences& influences) {
  std::vector<std::array<uint16_t, 4>> out;
  for (const auto& weights : influences.weights) {
    std::array<uint16_t, 4>& row = out.emplace_back();
    int left = 65535;
    for (size_t k = 1; k < 4; ++k) {
      row[k] = static_cast<uint16_t>(std::lround(65535 * weights[k]));
      left -= row[k];
    }
    row[0] = static_cast<uint16_t>(left);
  }
  return out;
}

Json small_primitive(Buffer& buffer, const Mesh& mesh, const Influences& influences) {
  const size_t count = mesh.vertices.size();
  Json attributes;
  attributes["POSITION"] =
      buffer.add(mesh.vertices.data(), count * 12, count, glb::f32, "VEC3", glb::vertices);
  Point low = mesh.vertices[0], high = low;
  for (const Point& p : mesh.vertices) low = low.cwiseMin(p), high = high.cwiseMax(p);
  buffer.set_bounds(attributes["POSITION"].get<int>(), three(low), three(high));
  if (!mesh.faces.empty()) {
    std::vector<std::array<int8_t, 4>> rows;
    for (const Vec3& n : vertex_normals<Vec3>(mesh.vertices, mesh.faces, Vec3::UnitY())) {
      std::array<int8_t, 4>& row = rows.emplace_back();
      for (int k = 0; k < 3; ++k)
        row[static_cast<size_t>(k)] = static_cast<int8_t>(std::lround(127 * n[k]));
    }
    attributes["NORMAL"] = buffer.add_bytes(rows.data(), count);
  }
  attributes["JOINTS_0"] =
      buffer.add(influences.joints.data(), count * 4, count, glb::u8, "VEC4", glb::vertices);
  const auto weights = short_weights(influences);
  attributes["WEIGHTS_0"] =
      buffer.add(weights.data(), count * 8, count, glb::u16, "VEC4", glb::vertices);
  buffer.set_normalized(attributes["WEIGHTS_0"].get<int>());
  Json primitive = {
      {"attributes", attributes}, {"material", 0}, {"mode", mesh.faces.empty() ? 0 : 4}};
  if (mesh.faces.empty()) return primitive;
  std::vector<uint16_t> indices;
  for (const Triangle& f : mesh.faces)
    for (const int32_t v : f) indices.push_back(static_cast<uint16_t>(v));
  const size_t corners = indices.size();
  primitive["indices"] =
      count < 65535
          ? buffer.add(indices.data(), 2 * corners, corners, glb::u16, "SCALAR", glb::indices)
          : buffer.add(mesh.faces.data(), 4 * corners, corners, glb::u32, "SCALAR", glb::indices);
  return primitive;
}

Json mesh_primitive(Buffer& buffer, const Mesh& mesh, const Influences& influences) {
  const size_t count = mesh.vertices.size();
  Json attributes;
  const int positions =
      buffer.add(mesh.vertices.data(), count * 12, count, glb::f32, "VEC3", glb::vertices);
  Point low = mesh.vertices[0], high = low;
  for (const Point& p : mesh.vertices) low = low.cwiseMin(p), high = high.cwiseMax(p);
  buffer.set_bounds(positions, three(low), three(high));
  attributes["POSITION"] = positions;
  if (!mesh.faces.empty()) {
    Points normals;
    for (const Vec3& n : vertex_normals<Vec3>(mesh.vertices, mesh.faces, Vec3::UnitY()))
      normals.push_back(n.cast<float>());
    attributes["NORMAL"] =
        buffer.add(normals.data(), count * 12, count, glb::f32, "VEC3", glb::vertices);
  }
  attributes["JOINTS_0"] =
      buffer.add(influences.joints.data(), count * 4, count, glb::u8, "VEC4", glb::vertices);
  attributes["WEIGHTS_0"] =
      buffer.add(influences.weights.data(), count * 16, count, glb::f32, "VEC4", glb::vertices);
  Json primitive = {
      {"attributes", attributes}, {"material", 0}, {"mode", mesh.faces.empty() ? 0 : 4}};
  if (!mesh.faces.empty())
    primitive["indices"] = buffer.add(mesh.faces.data(), mesh.faces.size() * 12,
                                      mesh.faces.size() * 3, glb::u32, "SCALAR", glb::indices);
  return primitive;
}

/// The inverse bind matrices undo exactly where the rounded nodes put the joints, so that at rest
/// the skinned mesh is the mesh itself.
Json skin(Buffer& buffer, const Json& nodes, const RigConvention& rig) {
  std::vector<std::array<float, 16>> inverse;
  Json joints = Json::array();
  const auto add = [&](const Mat3& axes, const Vec3& place) {
    // Column by column, as the format wants.
    Eigen::Map<Eigen::Matrix4f> m(inverse.emplace_back().data());
    m.setIdentity();
    m.topLeftCorner<3, 3>() = axes.transpose().cast<float>();
    m.topRightCorner<3, 1>() = (axes.transpose() * -place).cast<float>();
    joints.push_back(joints.size());
  };
  const Joints placed = glb::placed_joints(nodes, rig);
  for (size_t j = 0; j < kJoints; ++j) add(rig.axes[j], placed[j]);
  // They carry no weight, but programs make bones of what a skin lists.
  for (const ExtraNode& extra : rig.extra)
    add(rig.axes[static_cast<size_t>(extra.parent)], extra.place);
  if (!rig.root.empty()) add(Mat3::Identity(), Vec3::Zero());
  return {{"inverseBindMatrices", buffer.add(inverse.data(), inverse.size() * 64, inverse.size(),
                                             glb::f32, "MAT4", glb::none)},
          {"skeleton", glb::top_node(rig)},
          {"joints", joints}};
}

double top_of(const Mesh& mesh) {
  float top = mesh.vertices[0].y();
  for (const Point& p : mesh.vertices) top = std::max(top, p.y());
  return double{top};
}

std::array<float, 4> renormalise(const std::array<double, 4>& strongest) {
  const double sum = std::accumulate(strongest.begin(), strongest.end(), 0.0);
  std::array<float, 4> weights{};
  for (size_t k = 0; k < 4; ++k) {
    const auto weight = static_cast<float>(strongest[k] / sum);
    weights[k] = weight < kNegligible ? 0.0f : weight;
  }
  // Rounding of the weaker weights goes into the strongest weight, so that the sum is 1 in float32.
  weights[0] = static_cast<float>(1.0 - (double{weights[1]} + weights[2] + weights[3]));
  return weights;
}

Mesh checked(Mesh mesh, const std::string& path) {
  check_mesh(path, mesh.vertices, mesh.faces);
  return mesh;
}

Json millimetres(const DistanceSummary& metres) {
  const auto rounded = [](double x) { return std::round(x * 1e6) / 1e3; };
  return {
      {"mean", rounded(metres.mean)}, {"p95", rounded(metres.p95)}, {"max", rounded(metres.max)}};
}

}  // namespace

Influences strongest_four(const SkinWeights& weights) {
  Influences result;
  const auto count = static_cast<size_t>(weights.rows());
  result.joints.resize(count);
  result.weights.resize(count);
  for (size_t v = 0; v < count; ++v) {
    const auto row = weights.row(static_cast<Eigen::Index>(v));
    if (!row.allFinite() || row.minCoeff() < 0 || row.maxCoeff() <= 0)
      throw InputError("", "the skinning weights of vertex " + std::to_string(v) + " are unusable",
                       "give weights that are at least 0 and sum to 1");
    std::array<int, kJoints> order;
    std::iota(order.begin(), order.end(), 0);
    std::partial_sort(order.begin(), order.begin() + 4, order.end(),
                      [&](int a, int b) { return row[a] != row[b] ? row[a] > row[b] : a < b; });
    result.weights[v] = renormalise({row[order[0]], row[order[1]], row[order[2]], row[order[3]]});
    for (size_t k = 0; k < 4; ++k)
      result.joints[v][k] = result.weights[v][k] > 0 ? static_cast<uint8_t>(order[k]) : uint8_t{0};
  }
  return result;
}

GlbWriter::GlbWriter(std::string path, Mesh mesh, const Joints& rest, const SkinWeights& weights,
                     GlbOptions options)
    : path_(std::move(path)),
      mesh_(checked(std::move(mesh), path_)),
      rest_(rest),
      options_(std::move(options)),
      rig_(rig_convention(options_.skeleton, rest, top_of(mesh_))),
      tracks_(rig_) {
  if (static_cast<size_t>(weights.rows()) != mesh_.vertices.size())
    throw ShapeError("glb: weights " + std::to_string(weights.rows()) + " x 22 for " +
                     std::to_string(mesh_.vertices.size()) + " vertices");
  influences_ = strongest_four(weights);
  lost_ = weights;
  for (Eigen::Index v = 0; v < lost_.rows(); ++v) {
    lost_.row(v) /= -lost_.row(v).sum();
    for (size_t k = 0; k < 4; ++k) lost_(v, influences_.joints[v][k]) += influences_.weights[v][k];
  }
}

void GlbWriter::push(const Pose& pose, std::optional<double> confidence, const Points* surface) {
  if (!tracks_.push(pose))
    throw WorkError(path_ + ": the pose of frame " + std::to_string(frames()) +
                    " is not finite; check the source and the weights");
  if (confidence) confidence_.push_back(std::round(*confidence * 1e3) / 1e3);
  const PosedSkeleton posed = forward_kinematics(rest_, pose);
  measure_cut(posed);
  if (surface != nullptr) measure_surface(posed, *surface);
}

/// Adds to the surface error how far the file's four weights are from the exact surface.
void GlbWriter::measure_surface(const PosedSkeleton& posed, const Points& surface) {
  if (surface.size() != mesh_.vertices.size())
    throw ShapeError("glb: a surface of " + std::to_string(surface.size()) + " vertices for " +
                     std::to_string(mesh_.vertices.size()));
  for (size_t v = 0; v < surface.size(); ++v) {
    const Vec3 at = mesh_.vertices[v].cast<double>();
    Vec3 sum = Vec3::Zero();
    for (size_t k = 0; k < 4; ++k) {
      const size_t j = influences_.joints[v][k];
      sum +=
          double{influences_.weights[v][k]} * (posed.joints[j] + posed.global[j] * (at - rest_[j]));
    }
    surface_error_.add((sum - surface[v].cast<double>()).norm());
  }
}

/// Adds to the influence error what this pose loses: lost_ [V, 22] times the joints' transforms
/// [22, 12], some rows at a time.
void GlbWriter::measure_cut(const PosedSkeleton& posed) {
  Eigen::Matrix<float, kJoints, 12, Eigen::RowMajor> transforms;
  for (int j = 0; j < kJoints; ++j) {
    // Relative to the pelvis: a row of lost_ sums to 0 only up to rounding, and a walk far from the
    // origin would multiply that rounding.
    const Vec3 shift = posed.joints[j] - posed.joints[0] - posed.global[j] * rest_[j];
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c)
        transforms(j, 4 * r + c) = static_cast<float>(posed.global[j](r, c));
      transforms(j, 4 * r + 3) = static_cast<float>(shift[r]);
    }
  }
  constexpr Eigen::Index kBlock = 1024;
  Eigen::Matrix<float, Eigen::Dynamic, 12, Eigen::RowMajor> moved;
  for (Eigen::Index start = 0; start < lost_.rows(); start += kBlock) {
    const Eigen::Index count = std::min(kBlock, lost_.rows() - start);
    moved.noalias() = lost_.middleRows(start, count) * transforms;
    for (Eigen::Index v = 0; v < count; ++v) {
      const Eigen::Vector4f at = mesh_.vertices[start + v].homogeneous();
      const Eigen::Map<const Eigen::Matrix<float, 3, 4, Eigen::RowMajor>> m(moved.row(v).data());
      cut_error_.add(double{(m * at).norm()});
    }
  }
}

void GlbWriter::set_morphs(GlbMorphs morphs) {
  for (const auto& delta : morphs.deltas)
    if (delta.size() != 3 * mesh_.vertices.size())
      throw ShapeError("glb: a morph target of " + std::to_string(delta.size()) + " numbers for " +
                       std::to_string(mesh_.vertices.size()) + " vertices");
  if (morphs.weights.size() != morphs.deltas.size() * frames() ||
      morphs.distance.size() != frames())
    throw ShapeError("glb: weights and distances of morph targets for " + std::to_string(frames()) +
                     " frames");
  morphs_ = std::move(morphs);
}

std::string GlbWriter::bytes() const {
  Json root;
  root["asset"] = {{"version", "2.0"},
                   {"generator", "restage"},
                   {"extras",
                    {{"units", "metres, y up, facing +z"},
                     {"fps", options_.fps},
                     {"influences", 4},
                     {"influence_error_mm", millimetres(cut_error_.summary())},
                     {"pose_offsets", "not included"}}}};
  if (!surface_error_.empty())
    root["asset"]["extras"]["surface_error_mm"] = millimetres(surface_error_.summary());
  Buffer buffer;
  if (options_.small)
    root["extensionsUsed"] = root["extensionsRequired"] = Json::array({"KHR_mesh_quantization"});
  Json nodes = glb::nodes(rest_, rig_);
  root["scene"] = 0;
  root["scenes"] = Json::array({{{"nodes", {glb::top_node(rig_), nodes.size()}}}});
  const Json bones = nodes;
  nodes.push_back({{"name", "target"}, {"mesh", 0}, {"skin", 0}});
  root["nodes"] = std::move(nodes);
  const auto primitive = options_.small ? small_primitive : mesh_primitive;
  root["meshes"] = Json::array(
      {{{"name", "target"}, {"primitives", Json::array({primitive(buffer, mesh_, influences_)})}}});
  root["materials"] = Json::array({{{"name", "plain"},
                                    {"pbrMetallicRoughness",
                                     {{"baseColorFactor", {0.72, 0.56, 0.45, 1.0}},
                                      {"metallicFactor", 0.0},
                                      {"roughnessFactor", 0.75}}}}});
  root["skins"] = Json::array({skin(buffer, bones, rig_)});
  if (frames() > 0)
    root["animations"] =
        Json::array({glb::animation(buffer, tracks_, options_.clip, options_.fps, options_.small)});
  if (!confidence_.empty()) root["animations"][0]["extras"]["confidence"] = confidence_;
  if (!filled_.empty()) root["animations"][0]["extras"]["filled"] = filled_;
  if (morphs_ && frames() > 0) {
    const size_t node = root["nodes"].size() - 1;
    glb::add_morphs(buffer, *morphs_, frames(), node, root);
    root["asset"]["extras"]["surface_error_mm"] = millimetres(morphs_->error);
    Json& distances = root["animations"][0]["extras"]["distance_mm"] = Json::array();
    for (const double d : morphs_->distance)
      distances.push_back(d < 0 ? Json(nullptr) : Json(std::round(d * 1e5) / 1e2));
  }
  buffer.describe(root);
  return glb_bytes(root.dump(), buffer.bytes(), path_);
}

InfluenceError GlbWriter::commit() {
  write_file_atomically(path_, bytes());
  return influence_error();
}

}  // namespace restage
