#include "datasets/importers/bodies/makehuman.h"

#include <algorithm>

#include "datasets/hdf5/file.h"
#include "datasets/readers/errors.h"
#include "nn/geometry/skinning.h"

namespace restage {
namespace {

/// Bones whose heads are the 22 joints.
constexpr const char* kBones[kJoints] = {
    "pelvis",     "thigh_l",    "thigh_r",    "spine_01", "calf_l",     "calf_r",
    "spine_02",   "foot_l",     "foot_r",     "spine_03", "ball_l",     "ball_r",
    "neck_01",    "clavicle_l", "clavicle_r", "head",     "upperarm_l", "upperarm_r",
    "lowerarm_l", "lowerarm_r", "hand_l",     "hand_r"};

[[noreturn]] void broken(const std::string& where, const std::string& what) {
  throw InputError(where, what, "fetch makehuman.h5 again");
}

/// Numbers that must be indices below `limit`.
void check_indices(const std::vector<int32_t>& values, size_t limit, int32_t lowest,
                   const std::string& where) {
  for (const int32_t v : values)
    if (v < lowest || (v >= 0 && static_cast<size_t>(v) >= limit))
      broken(where, cat("holds the index ", v, " of ", limit));
}

/// From the rest joints to a posed skeleton, in place.
void skin(SkinnedSurface& surface, const Joints& rest, const PosedSkeleton& posed) {
  for (size_t v = 0; v < surface.vertices.size(); ++v)
    surface.vertices[v] = blend(surface.vertices[v], surface.weights[v].data(), rest, posed);
}

double lowest(const SkinnedSurface& surface) {
  double floor = surface.vertices.at(0).y();
  for (const Vec3& x : surface.vertices) floor = std::min(floor, x.y());
  return floor;
}

/// Adds the quads of `skin` that touch no hidden vertex, with the vertices they need.
void append_bare(const SkinnedSurface& skin, const std::vector<uint8_t>& hidden,
                 SkinnedSurface& out) {
  std::vector<int32_t> moved(skin.vertices.size(), -1);
  for (std::array<int32_t, 4> quad : skin.quads) {
    bool bare = true;
    for (const int32_t v : quad) bare = bare && hidden[v] == 0;
    if (!bare) continue;
    for (int32_t& v : quad) {
      if (moved[v] < 0) {
        moved[v] = static_cast<int32_t>(out.vertices.size());
        out.vertices.push_back(skin.vertices[v]);
        out.weights.push_back(skin.weights[v]);
      }
      v = moved[v];
    }
    out.quads.push_back(quad);
  }
}

/// From decimetres to a Body in metres that stands on y = 0: all first halves of the quads, then
/// all second halves, without degenerate triangles.
Body to_body(const SkinnedSurface& surface, const Joints& joints, double floor) {
  Body out;
  const Vec3 down(0, floor, 0);
  for (const Vec3& x : surface.vertices)
    out.rest.vertices.push_back(((x - down) / 10).cast<float>());
  for (int j = 0; j < kJoints; ++j) out.joints[j] = (joints[j] - down) / 10;
  out.definition = "makehuman";
  for (const int half : {1, 2})
    for (const auto& quad : surface.quads) {
      const Triangle t = {quad[0], quad[half], quad[half + 1]};
      if (t[0] != t[1] && t[1] != t[2] && t[0] != t[2]) out.rest.faces.push_back(t);
    }
  out.weights.resize(surface.weights.size(), kJoints);
  for (size_t v = 0; v < surface.weights.size(); ++v)
    for (size_t j = 0; j < kJoints; ++j)
      out.weights(v, j) = static_cast<float>(surface.weights[v][j]);
  return out;
}

}  // namespace

MakeHuman::MakeHuman(const std::string& folder) : folder_(folder), path_(folder + "/makehuman.h5") {
  const h5::File file = h5::File::open(path_);
  const std::vector<double> base = file.read<double>("/base/vertices", {-1, 3});
  for (size_t i = 0; i + 2 < base.size(); i += 3) {
    base_.emplace_back(base[i], base[i + 1], base[i + 2]);
    if (!base_.back().allFinite())
      broken(path_ + ":/base/vertices", "holds a number that is not finite");
  }
  const std::vector<int32_t> quads = file.read<int32_t>("/base/body_quads", {-1, 4});
  check_indices(quads, base_.size(), 0, path_ + ":/base/body_quads");
  for (size_t i = 0; i + 3 < quads.size(); i += 4) {
    quads_.push_back({quads[i], quads[i + 1], quads[i + 2], quads[i + 3]});
    for (size_t k = 0; k < 4; ++k) skin_ = std::max(skin_, static_cast<size_t>(quads[i + k]) + 1);
  }
  if (quads_.empty()) broken(path_ + ":/base/body_quads", "is empty");
  read_rig(file);
  read_targets(file);
}

void MakeHuman::read_rig(const h5::File& file) {
  bones_ = file.dataset("/rig/bone_names").read_text();
  const int64_t n = bones_.size();
  const std::vector<int32_t> parents = file.read<int32_t>("/rig/bone_parent", {n});
  const h5::Dataset heads = file.dataset("/rig/head_vertices", {n, -1});
  const std::vector<int32_t> head_vertices = heads.read<int32_t>();
  check_indices(head_vertices, base_.size(), -1, heads.where());
  heads_.resize(bones_.size());
  for (size_t i = 0; i < head_vertices.size(); ++i)
    if (head_vertices[i] >= 0)
      heads_[i / static_cast<size_t>(heads.row_size())].push_back(head_vertices[i]);

  // Every bone counts for its nearest ancestor that is one of the 22 joints (fingers: the wrist).
  std::vector<size_t> joint(bones_.size(), 0);
  check_indices(parents, bones_.size(), -1, path_ + ":/rig/bone_parent");
  for (size_t b = 0; b < bones_.size(); ++b) {
    size_t steps = 0;
    for (int at = static_cast<int>(b); at >= 0; at = parents[at]) {
      const auto found = std::find(std::begin(kBones), std::end(kBones), bones_[at]);
      joint[b] = static_cast<size_t>(found - std::begin(kBones));
      if (joint[b] < kJoints) break;
      if (++steps > bones_.size()) broken(path_ + ":/rig/bone_parent", "goes round in circles");
    }
    if (joint[b] >= kJoints) joint[b] = 0;
  }
  for (const char* name : kBones)
    if (heads_[bone_index(name)].empty())
      broken(path_ + ":/rig/head_vertices", cat("has no head of ", name));

  read_weights(file, joint);
}

void MakeHuman::read_weights(const h5::File& file, const std::vector<size_t>& joint_of_bone) {
  const std::vector<double> value = file.read<double>("/rig/weight_value", {-1});
  const int64_t count = value.size();
  const std::vector<int32_t> bone = file.read<int32_t>("/rig/weight_bone", {count});
  const std::vector<int32_t> vertex = file.read<int32_t>("/rig/weight_vertex", {count});
  check_indices(bone, bones_.size(), 0, path_ + ":/rig/weight_bone");
  check_indices(vertex, base_.size(), 0, path_ + ":/rig/weight_vertex");
  weights_.assign(base_.size(), {});
  for (size_t i = 0; i < value.size(); ++i) {
    if (!(value[i] >= 0 && value[i] < 1e6))
      broken(path_ + ":/rig/weight_value", "holds a negative weight");
    weights_[vertex[i]][joint_of_bone[bone[i]]] += value[i];
  }
  for (auto& row : weights_) {
    double sum = 0;
    for (const double w : row) sum += w;
    if (sum > 0)
      for (double& w : row) w /= sum;
    else
      row[0] = 1;
  }
}

void MakeHuman::read_targets(const h5::File& file) {
  const std::vector<std::string> names = file.dataset("/targets/names").read_text();
  const int64_t n = names.size();
  const std::vector<int64_t> start = file.read<int64_t>("/targets/start", {n});
  const std::vector<int64_t> count = file.read<int64_t>("/targets/count", {n});
  target_vertex_ = file.read<int32_t>("/targets/index", {-1});
  const int64_t total = target_vertex_.size();
  target_delta_ = file.read<int16_t>("/targets/delta_milli", {total, 3});
  check_indices(target_vertex_, base_.size(), 0, path_ + ":/targets/index");
  for (size_t t = 0; t < names.size(); ++t) {
    if (start[t] < 0 || count[t] < 0 || start[t] > total || count[t] > total - start[t])
      broken(path_ + ":/targets", names[t] + " lies outside of the stored deltas");
    targets_[names[t]] = {static_cast<size_t>(start[t]), static_cast<size_t>(count[t])};
  }
}

std::vector<Vec3> MakeHuman::shape(const TargetWeights& weights) const {
  std::vector<Vec3> out = base_;
  for (const auto& [name, weight] : weights) {
    const auto target = targets_.find(name);
    if (weight == 0.0 || target == targets_.end()) continue;  // not every mixture has a target
    const size_t end = target->second.start + target->second.count;
    for (size_t i = target->second.start; i < end; ++i) {
      const int16_t* d = &target_delta_[3 * i];
      out[target_vertex_[i]] += weight / 1000.0 * Vec3(d[0], d[1], d[2]);
    }
  }
  return out;
}

size_t MakeHuman::bone_index(const std::string& name) const {
  const auto at = std::find(bones_.begin(), bones_.end(), name);
  if (at == bones_.end()) broken(path_ + ":/rig/bone_names", "has no bone " + name);
  return static_cast<size_t>(at - bones_.begin());
}

Vec3 MakeHuman::bone_head(const std::vector<Vec3>& vertices, size_t bone) const {
  Vec3 sum = Vec3::Zero();
  for (const int32_t v : heads_[bone]) sum += vertices[v];
  return sum / static_cast<double>(std::max<size_t>(1, heads_[bone].size()));
}

/// Upper arm, forearm and hand (to the middle knuckle) are each turned onto +x (left) or -x.
Rotations MakeHuman::t_pose_rotations(const std::vector<Vec3>& vertices, const Joints& j) const {
  Rotations out;
  out.fill(Mat3::Identity());
  for (const int side : {0, 1}) {
    const int shoulder = 16 + side, elbow = shoulder + 2, wrist = shoulder + 4;
    const Vec3 x(side == 0 ? 1.0 : -1.0, 0, 0);
    const Vec3 knuckle = bone_head(vertices, bone_index(side == 0 ? "middle_01_l" : "middle_01_r"));
    out[shoulder] = shortest_arc(j[elbow] - j[shoulder], x);
    out[elbow] = shortest_arc(j[wrist] - j[elbow], x);
    out[wrist] = shortest_arc(knuckle - j[wrist], x);
  }
  return out;
}

SkinnedSurface MakeHuman::skin_of(const std::vector<Vec3>& vertices) const {
  const auto skin = skin_;
  return {std::vector<Vec3>(vertices.begin(), vertices.begin() + skin),
          std::vector<JointWeights>(weights_.begin(), weights_.begin() + skin), quads_};
}

std::vector<Vec3> MakeHuman::shaped(const BodyRecipe& recipe, Joints& joints) const {
  for (const auto& [name, value] : recipe.values)
    if (name.find('/') != std::string::npos && value != 0.0 &&
        targets_.count(name + (value > 0 ? "-incr" : "-decr")) == 0)
      throw InputError(path_, "has no target for the slider " + name, "correct the column's name");
  std::vector<Vec3> vertices = shape(recipe_targets(recipe));
  for (int j = 0; j < kJoints; ++j) joints[j] = bone_head(vertices, bone_index(kBones[j]));
  return vertices;
}

PosedSkeleton MakeHuman::t_pose(const std::vector<Vec3>& vertices, const Joints& joints) const {
  Pose pose;
  pose.local = to_local(t_pose_rotations(vertices, joints));
  pose.root = joints[0];
  return forward_kinematics(joints, pose);
}

Body MakeHuman::build(const BodyRecipe& recipe, const std::string& garment) const {
  Joints joints;
  const std::vector<Vec3> vertices = shaped(recipe, joints);
  const PosedSkeleton posed = t_pose(vertices, joints);
  SkinnedSurface surface = skin_of(vertices);
  skin(surface, joints, posed);
  const double floor = lowest(surface);
  if (!garment.empty()) {
    surface = fit_garment(vertices, garment);
    skin(surface, joints, posed);
  }
  Body body = to_body(surface, posed.joints, floor);
  body.id = garment.empty() ? recipe.id : recipe.id + "_" + garment;
  body.split = recipe.split;
  return body;
}

Body MakeHuman::dress(const BodyRecipe& recipe, const std::string& garment) const {
  Joints joints;
  const std::vector<Vec3> vertices = shaped(recipe, joints);
  std::vector<uint8_t> hidden;
  SkinnedSurface surface = fit_garment(vertices, garment, &hidden);
  append_bare(skin_of(vertices), hidden, surface);
  const PosedSkeleton posed = t_pose(vertices, joints);
  skin(surface, joints, posed);
  Body body = to_body(surface, posed.joints, lowest(surface));
  body.id = recipe.id;
  body.split = recipe.split;
  return body;
}

}  // namespace restage
