#include "datasets/importers/rigs/gltf_own_rig.h"

#include <algorithm>

#include "autograd/base/format.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/gltf/gltf_blends.h"
#include "datasets/readers/text/text.h"

namespace restage {

FingerBones rig_fingers(const Gltf& file, const GltfRig& rig) {
  std::vector<std::string> names;
  std::vector<int> parents;
  for (const GltfNode& node : file.nodes) {
    names.push_back(file.humanoid.empty() ? node.name : "");
    parents.push_back(node.parent);
  }
  for (const auto& [name, node] : file.humanoid) names[static_cast<size_t>(node)] = name;
  return find_fingers(names, parents, {rig.node[kLeftWrist], rig.node[kRightWrist]});
}

FingerTurns rig_fingers_at(const GltfRig& rig, const FingerBones& bones,
                           const GltfTransforms& world) {
  FingerTurns out;
  for (size_t k = 0; k < out.size(); ++k) {
    if (bones[k] < 0) continue;
    const auto n = static_cast<size_t>(bones[k]);
    const Mat3 from_t =
        rotation_of(world[n].linear()) * rotation_of(rig.t_pose[n].linear()).transpose();
    out[k] = rig.turn * from_t * rig.turn.transpose();
  }
  return out;
}

GltfOwnRig::GltfOwnRig(Gltf file, GltfRig rig) : file_(std::move(file)), rig_(std::move(rig)) {
  joint_of_.assign(file_.nodes.size(), -1);
  for (size_t j = 1; j < kJoints; ++j)
    if (rig_.offset[j].isZero()) joint_of_[static_cast<size_t>(rig_.node[j])] = static_cast<int>(j);
  // A first spine bone that carries the legs turns with the pelvis, or the legs would be moved.
  for (const int node : {rig_.node[kPelvis], rig_.hips})
    joint_of_[static_cast<size_t>(node)] = kPelvis;
  for (const int node : rig_.strays)
    joint_of_[static_cast<size_t>(node)] = rig_.joint[static_cast<size_t>(node)];
  finger_of_.assign(file_.nodes.size(), -1);
  const FingerBones fingers = rig_fingers(file_, rig_);
  for (size_t k = 0; k < fingers.size(); ++k)
    if (fingers[k] >= 0) finger_of_[static_cast<size_t>(fingers[k])] = static_cast<int>(k);
  const GltfTransforms t_pose = world(nullptr);
  mesh_ = gltf_mesh(file_, t_pose);
  for (Point& p : mesh_.vertices) p = rig_.to_ours(p.cast<double>()).cast<float>();
  for (size_t j = 0; j < kJoints; ++j) rest_[j] = joint_at(t_pose, j);
  const Vec3 moved = put_on_floor(mesh_, rest_[kPelvis]);
  for (Vec3& x : rest_) x -= moved;
  twists_ = find_twist_bones(file_, rig_, rest_, joint_of_);
}

/// How a node is turned from the T-pose, in our axes; nothing: it keeps its rest.
std::optional<Mat3> GltfOwnRig::turn_of(size_t node, const Rotations& global,
                                        const FingerTurns* fingers) const {
  for (const TwistBone& bone : twists_)
    if (bone.node == static_cast<int>(node))
      return global[bone.joint] * twist_of(bone, rest_, global);
  if (const int j = joint_of_[node]; j >= 0) return global[static_cast<size_t>(j)];
  if (const int k = finger_of_[node]; k >= 0 && fingers != nullptr)
    return (*fingers)[static_cast<size_t>(k)];
  return std::nullopt;
}

GltfTransforms GltfOwnRig::world(const Pose* pose, const FingerTurns* fingers,
                                 NodeTurns* turns) const {
  Rotations global;
  global.fill(Mat3::Identity());
  if (pose != nullptr) global = to_global(pose->local);
  for (const int side : {0, 1})
    if (pose != nullptr && !shares_twist(side)) share_twist(side, rest_, &global);
  GltfTransforms out(file_.nodes.size());
  for (const int at : rig_.order) {
    const auto n = static_cast<size_t>(at);
    const GltfNode& node = file_.nodes[n];
    const Eigen::Affine3d parent =
        node.parent < 0 ? Eigen::Affine3d::Identity() : out[static_cast<size_t>(node.parent)];
    GltfNode moved = node;
    if (const std::optional<Mat3> turn = turn_of(n, global, fingers)) {
      const Mat3 in_file = rig_.turn.transpose() * *turn * rig_.turn;
      const Mat3 wanted = in_file * rotation_of(rig_.t_pose[n].linear());
      moved.rotation = Quat(rotation_of(parent.linear()).transpose() * wanted).normalized();
      if (turns != nullptr) turns->local.emplace_back(node.number, moved.rotation);
    }
    const bool hips = pose != nullptr && at == rig_.hips, loose = rig_.carrier[n] != node.parent;
    if (hips)
      moved.translation = parent.inverse() * hips_place(*pose);
    else if (loose)
      moved.translation = parent.inverse() * carried(out, n);
    if (turns != nullptr && (hips || loose))
      turns->moved.emplace_back(node.number, moved.translation);
    out[n] = parent * moved.local();
  }
  return out;
}

bool GltfOwnRig::shares_twist(int side) const {
  return std::any_of(twists_.begin(), twists_.end(), [&](const TwistBone& bone) {
    return bone.joint == static_cast<size_t>(kLeftElbow + side);
  });
}

/// Where the node that is moved has to be for the pelvis to lie where the pose says.
Vec3 GltfOwnRig::hips_place(const Pose& pose) const {
  const Vec3 pelvis = rig_.turn.transpose() * pose.root / rig_.scale;
  if (rig_.hips != rig_.node[kPelvis]) return pelvis;
  return pelvis - rig_.turn.transpose() * pose.local[kPelvis] * rig_.turn * rig_.offset[kPelvis];
}

/// Where the node's carrier takes it.
Vec3 GltfOwnRig::carried(const GltfTransforms& world, size_t node) const {
  const auto c = static_cast<size_t>(rig_.carrier[node]);
  const Eigen::Affine3d &rest = rig_.t_pose[c], &now = world[c];
  const Vec3 apart = rig_.t_pose[node].translation() - rest.translation();
  return now.translation() + now.linear() * rest.linear().inverse() * apart;
}

/// Rotations keep bones together, whatever they are. So a bone that leaves its neighbour hangs
/// elsewhere than it seemed, and the figure would be torn.
void GltfOwnRig::check_joined(const Joints& joints) const {
  constexpr double kTorn = 0.03;  // of the distance from the floor to the head
  for (size_t j = 1; j < kJoints; ++j) {
    auto p = static_cast<size_t>(kParents[j]);
    while (p > 0 && !rig_.offset[p].isZero()) p = static_cast<size_t>(kParents[p]);
    if (!rig_.offset[j].isZero() || !rig_.offset[p].isZero()) continue;
    // What hangs on its neighbour, or is carried by it, can only be stretched, by uneven scales.
    bool joined = false;
    for (int n = rig_.node[j]; n >= 0 && !joined; n = file_.nodes[static_cast<size_t>(n)].parent)
      joined = n == rig_.node[p] || rig_.carrier[static_cast<size_t>(n)] == rig_.node[p];
    if (joined) continue;
    const double rest = (rest_[j] - rest_[p]).norm(), now = (joints[j] - joints[p]).norm();
    if (std::abs(now - rest) < kTorn * rest_[kHead].y()) continue;
    const auto name = [&](size_t k) {
      return text::quote(file_.nodes[static_cast<size_t>(rig_.node[k])].name);
    };
    throw InputError(file_.path,
                     cat("bone ", name(j), " (", kJointNames[j], ") would leave ", name(p), " (",
                         kJointNames[p], "): ", format("%.2f m become %.2f", rest, now)),
                     "say which bone is which joint with {bones} names.yaml (docs/formats.md)");
  }
}

Vec3 GltfOwnRig::joint_at(const GltfTransforms& world, size_t j) const {
  const auto n = static_cast<size_t>(rig_.node[j]);
  const Mat3 from_t = world[n].linear() * rig_.t_pose[n].linear().inverse();
  return rig_.to_ours(world[n].translation() + from_t * rig_.offset[j]);
}

void GltfOwnRig::place(const Pose& pose, const FingerTurns* fingers, Joints* joints,
                       Points* vertices) const {
  const GltfTransforms nodes = world(&pose, fingers);
  for (size_t j = 0; j < kJoints; ++j) (*joints)[j] = joint_at(nodes, j);
  check_joined(*joints);
  if (vertices == nullptr) return;
  *vertices = gltf_mesh(file_, nodes).vertices;
  for (Point& p : *vertices) p = rig_.to_ours(p.cast<double>()).cast<float>();
}

std::vector<Mat3> GltfOwnRig::blends(const Pose& pose) const {
  std::vector<Mat3> out = gltf_blends(file_, world(&pose));
  for (Mat3& blend : out) blend = rig_.scale * rig_.turn * blend;
  return out;
}

NodeTurns GltfOwnRig::turns(const Pose& pose, const FingerTurns* fingers) const {
  NodeTurns out;
  world(&pose, fingers, &out);
  return out;
}

}  // namespace restage
