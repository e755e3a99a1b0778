#include "infer/writers/glb.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "nn/geometry/glb_file.h"
#include "nn/geometry/mesh_file.h"

namespace restage {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kBin = 1e-5;         // metres, so the percentile is exact to 0.01 mm
constexpr size_t kBins = 20000;       // distances up to 0.2 m
constexpr float kNegligible = 1e-6f;  // a joint with a smaller weight is left out
enum Component { u8 = 5121, u32 = 5125, f32 = 5126 };
enum Target { none = 0, vertices = 34962, indices = 34963 };

/// The binary chunk of the file, with the buffer views and accessors that describe its content.
class Buffer {
 public:
  /// Adds `count` elements to the chunk and returns the number of their accessor.
  int add(const void* data, size_t bytes, size_t count, Component component, const char* type,
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
  /// Writes the least and the largest value into an accessor: the format wants that for positions
  /// and times.
  void set_bounds(int accessor, const std::vector<float>& low, const std::vector<float>& high) {
    accessors_[accessor]["min"] = low;
    accessors_[accessor]["max"] = high;
  }
  void describe(Json& root) const {
    root["buffers"] = Json::array({{{"byteLength", bytes_.size()}}});
    root["bufferViews"] = views_;
    root["accessors"] = accessors_;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
  Json views_ = Json::array(), accessors_ = Json::array();
};

std::vector<float> three(const Point& p) { return {p.x(), p.y(), p.z()}; }

/// Unit normals of the vertices: means over the faces around a vertex, weighted by area. A vertex
/// without faces gets a normal that points straight up.
Points vertex_normals(const Mesh& mesh) {
  std::vector<Vec3> sums(mesh.vertices.size(), Vec3::Zero());
  for (const Triangle& f : mesh.faces) {
    const Vec3 a = mesh.vertices[f[0]].cast<double>(), b = mesh.vertices[f[1]].cast<double>(),
               c = mesh.vertices[f[2]].cast<double>();
    const Vec3 normal = (b - a).cross(c - a);
    for (const int32_t v : f) sums[v] += normal;
  }
  Points normals(sums.size());
  for (size_t v = 0; v < sums.size(); ++v) {
    const double length = sums[v].norm();
    normals[v] = length > 1e-30 ? Point((sums[v] / length).cast<float>()) : Point(0, 1, 0);
  }
  return normals;
}

Json mesh_primitive(Buffer& buffer, const Mesh& mesh, const Influences& influences) {
  const size_t count = mesh.vertices.size();
  Json attributes;
  const int positions =
      buffer.add(mesh.vertices.data(), count * 12, count, f32, "VEC3", Target::vertices);
  Point low = mesh.vertices[0], high = low;
  for (const Point& p : mesh.vertices) low = low.cwiseMin(p), high = high.cwiseMax(p);
  buffer.set_bounds(positions, three(low), three(high));
  attributes["POSITION"] = positions;
  if (!mesh.faces.empty()) {
    const Points normals = vertex_normals(mesh);
    attributes["NORMAL"] =
        buffer.add(normals.data(), count * 12, count, f32, "VEC3", Target::vertices);
  }
  attributes["JOINTS_0"] =
      buffer.add(influences.joints.data(), count * 4, count, u8, "VEC4", Target::vertices);
  attributes["WEIGHTS_0"] =
      buffer.add(influences.weights.data(), count * 16, count, f32, "VEC4", Target::vertices);
  Json primitive = {
      {"attributes", attributes}, {"material", 0}, {"mode", mesh.faces.empty() ? 0 : 4}};
  if (!mesh.faces.empty())
    primitive["indices"] = buffer.add(mesh.faces.data(), mesh.faces.size() * 12,
                                      mesh.faces.size() * 3, u32, "SCALAR", Target::indices);
  return primitive;
}

/// The file's nodes: nodes 0 to 21 are the joints, node 22 is the skinned mesh.
Json nodes(const Joints& rest) {
  Json list = Json::array();
  for (int j = 0; j < kJoints; ++j) {
    const Vec3 offset = j == 0 ? rest[0] : Vec3(rest[j] - rest[kParents[j]]);
    Json node = {{"name", std::string(kJointNames[j])},
                 {"translation", three(offset.cast<float>())}};
    for (int child = j + 1; child < kJoints; ++child)
      if (kParents[child] == j) node["children"].push_back(child);
    list.push_back(node);
  }
  list.push_back({{"name", "target"}, {"mesh", 0}, {"skin", 0}});
  return list;
}

Json skin(Buffer& buffer, const Joints& rest) {
  // A program adds up the nodes' offsets, which are rounded to float32. The inverse bind matrices
  // undo exactly these rounded sums, so that at rest the skinned mesh is the mesh itself.
  std::vector<std::array<float, 16>> inverse(kJoints);
  Joints placed;
  for (int j = 0; j < kJoints; ++j) {
    const Vec3 offset = j == 0 ? rest[0] : Vec3(rest[j] - rest[kParents[j]]);
    placed[j] =
        offset.cast<float>().cast<double>() + (j == 0 ? Vec3(Vec3::Zero()) : placed[kParents[j]]);
    Eigen::Map<Eigen::Matrix4f> m(inverse[j].data());  // column by column, as the format wants
    m.setIdentity();
    m.topRightCorner<3, 1>() = (-placed[j]).cast<float>();
  }
  Json joints = Json::array();
  for (int j = 0; j < kJoints; ++j) joints.push_back(j);
  return {{"inverseBindMatrices",
           buffer.add(inverse.data(), inverse.size() * 64, kJoints, f32, "MAT4", none)},
          {"skeleton", 0},
          {"joints", joints}};
}

Json animation(Buffer& buffer, const std::vector<std::array<float, 4>>& turns,
               const std::vector<float>& roots, double fps) {
  const size_t frames = roots.size() / 3;
  std::vector<float> times(frames);
  for (size_t f = 0; f < frames; ++f) times[f] = static_cast<float>(static_cast<double>(f) / fps);
  const int input = buffer.add(times.data(), frames * 4, frames, f32, "SCALAR", none);
  buffer.set_bounds(input, {times.front()}, {times.back()});
  Json samplers = Json::array(), channels = Json::array();
  const auto channel = [&](int node, const char* path, int output) {
    channels.push_back(
        {{"sampler", samplers.size()}, {"target", {{"node", node}, {"path", path}}}});
    samplers.push_back({{"input", input}, {"interpolation", "LINEAR"}, {"output", output}});
  };
  channel(0, "translation", buffer.add(roots.data(), frames * 12, frames, f32, "VEC3", none));
  std::vector<std::array<float, 4>> track(frames);
  for (int j = 0; j < kJoints; ++j) {
    for (size_t f = 0; f < frames; ++f) track[f] = turns[f * kJoints + static_cast<size_t>(j)];
    channel(j, "rotation", buffer.add(track.data(), frames * 16, frames, f32, "VEC4", none));
  }
  return {{"name", "motion"}, {"channels", channels}, {"samplers", samplers}};
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
                     double fps)
    : path_(std::move(path)),
      mesh_(std::move(mesh)),
      rest_(rest),
      fps_(fps),
      histogram_(kBins + 1) {
  check_mesh(path_, mesh_.vertices, mesh_.faces);
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

void GlbWriter::push(const Pose& pose, std::optional<double> confidence) {
  bool finite = pose.root.allFinite();
  for (const Mat3& r : pose.local) finite = finite && r.allFinite();
  if (!finite)
    throw WorkError(path_ + ": the pose of frame " + std::to_string(frames()) +
                    " is not finite; check the source and the weights");
  const std::array<float, 4>* before = frames() > 0 ? &turns_[turns_.size() - kJoints] : nullptr;
  std::array<std::array<float, 4>, kJoints> turns;
  for (size_t j = 0; j < kJoints; ++j) {
    const Quat q = Quat(pose.local[j]).normalized();
    Eigen::Vector4d c = q.coeffs();  // x, y, z, w
    // q and -q are the same rotation. LINEAR interpolates the short way only if two quaternions
    // that follow each other have signs that agree.
    const double side = before != nullptr ? c[0] * before[j][0] + c[1] * before[j][1] +
                                                c[2] * before[j][2] + c[3] * before[j][3]
                                          : c[3];
    if (side < 0) c = -c;
    for (int k = 0; k < 4; ++k) turns[j][k] = static_cast<float>(c[k]);
  }
  turns_.insert(turns_.end(), turns.begin(), turns.end());
  for (int k = 0; k < 3; ++k) roots_.push_back(static_cast<float>(pose.root[k]));
  if (confidence) confidence_.push_back(std::round(*confidence * 1e3) / 1e3);
  measure_cut(pose);
}

/// Adds to the influence error what this pose loses: lost_ [V, 22] times the joints' transforms
/// [22, 12], some rows at a time.
void GlbWriter::measure_cut(const Pose& pose) {
  const PosedSkeleton posed = forward_kinematics(rest_, pose);
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
      const double error = (m * at).norm();
      error_sum_ += error;
      error_max_ = std::max(error_max_, error);
      ++histogram_[std::min(kBins, static_cast<size_t>(error / kBin))];
    }
  }
}

InfluenceError GlbWriter::influence_error() const {
  const uint64_t total = std::accumulate(histogram_.begin(), histogram_.end(), uint64_t{0});
  if (total == 0) return {};
  InfluenceError result{error_sum_ / static_cast<double>(total), 0, error_max_};
  uint64_t seen = 0;
  for (size_t bin = 0; bin < histogram_.size(); ++bin) {
    seen += histogram_[bin];
    if (static_cast<double>(seen) < 0.95 * static_cast<double>(total)) continue;
    result.p95 = std::min(error_max_, static_cast<double>(bin + 1) * kBin);
    break;
  }
  return result;
}

std::string GlbWriter::bytes() const {
  const InfluenceError cut = influence_error();
  const auto millimetres = [](double metres) { return std::round(metres * 1e6) / 1e3; };
  Json root;
  root["asset"] = {{"version", "2.0"},
                   {"generator", "restage"},
                   {"extras",
                    {{"units", "metres, y up, facing +z"},
                     {"fps", fps_},
                     {"influences", 4},
                     {"influence_error_mm",
                      {{"mean", millimetres(cut.mean)},
                       {"p95", millimetres(cut.p95)},
                       {"max", millimetres(cut.max)}}},
                     {"pose_offsets", "not included"}}}};
  Buffer buffer;
  root["scene"] = 0;
  root["scenes"] = Json::array({{{"nodes", {0, kJoints}}}});
  root["nodes"] = nodes(rest_);
  root["meshes"] =
      Json::array({{{"name", "target"},
                    {"primitives", Json::array({mesh_primitive(buffer, mesh_, influences_)})}}});
  root["materials"] = Json::array({{{"name", "plain"},
                                    {"pbrMetallicRoughness",
                                     {{"baseColorFactor", {0.72, 0.56, 0.45, 1.0}},
                                      {"metallicFactor", 0.0},
                                      {"roughnessFactor", 0.75}}}}});
  root["skins"] = Json::array({skin(buffer, rest_)});
  if (frames() > 0) root["animations"] = Json::array({animation(buffer, turns_, roots_, fps_)});
  if (!confidence_.empty()) root["animations"][0]["extras"]["confidence"] = confidence_;
  if (!filled_.empty()) root["animations"][0]["extras"]["filled"] = filled_;
  buffer.describe(root);
  return glb_bytes(root.dump(), buffer.bytes(), path_);
}

InfluenceError GlbWriter::commit() {
  write_file_atomically(path_, bytes());
  return influence_error();
}

}  // namespace restage
