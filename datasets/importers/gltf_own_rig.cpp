#include "datasets/importers/gltf_own_rig.h"

#include <algorithm>

namespace restage {

GltfOwnRig::GltfOwnRig(Gltf file, GltfRig rig) : file_(std::move(file)), rig_(std::move(rig)) {
  joint_of_.assign(file_.nodes.size(), -1);
  for (size_t j = 1; j < kJoints; ++j)
    if (rig_.offset[j].isZero()) joint_of_[static_cast<size_t>(rig_.node[j])] = static_cast<int>(j);
  // A first spine bone that carries the legs turns with the pelvis, or the legs would be moved.
  for (const int node : {rig_.node[kPelvis], rig_.hips})
    joint_of_[static_cast<size_t>(node)] = kPelvis;
  for (size_t n = 0; n < joint_of_.size(); ++n)
    if (joint_of_[n] >= 0) driven_.push_back(file_.nodes[n].number);
  const GltfTransforms t_pose = world(nullptr);
  mesh_ = gltf_mesh(file_, t_pose);
  for (Point& p : mesh_.vertices) p = rig_.to_ours(p.cast<double>()).cast<float>();
  for (size_t j = 0; j < kJoints; ++j) rest_[j] = joint_at(t_pose, j);
  const Vec3 moved = put_on_floor(mesh_, rest_[kPelvis]);
  for (Vec3& x : rest_) x -= moved;
}

GltfTransforms GltfOwnRig::world(const Pose* pose, NodeTurns* turns) const {
  Rotations global;
  global.fill(Mat3::Identity());
  if (pose != nullptr) global = to_global(pose->local);
  for (Mat3& turn : global) turn = rig_.turn.transpose() * turn * rig_.turn;  // the file's axes
  GltfTransforms out(file_.nodes.size());
  for (size_t n = 0; n < out.size(); ++n) {
    const GltfNode& node = file_.nodes[n];
    const Eigen::Affine3d parent =
        node.parent < 0 ? Eigen::Affine3d::Identity() : out[static_cast<size_t>(node.parent)];
    GltfNode moved = node;
    if (const int j = joint_of_[n]; j >= 0) {
      const Mat3 wanted = global[static_cast<size_t>(j)] * rotation_of(rig_.t_pose[n].linear());
      moved.rotation = Quat(rotation_of(parent.linear()).transpose() * wanted).normalized();
      if (turns != nullptr) turns->local.push_back(moved.rotation);
    }
    if (pose != nullptr && static_cast<int>(n) == rig_.hips) {
      moved.translation = parent.inverse() * Vec3(rig_.turn.transpose() * pose->root / rig_.scale);
      if (turns != nullptr) turns->hips = moved.translation;
    }
    out[n] = parent * moved.local();
  }
  return out;
}

Vec3 GltfOwnRig::joint_at(const GltfTransforms& world, size_t j) const {
  const auto n = static_cast<size_t>(rig_.node[j]);
  const Mat3 from_t = world[n].linear() * rig_.t_pose[n].linear().inverse();
  return rig_.to_ours(world[n].translation() + from_t * rig_.offset[j]);
}

void GltfOwnRig::place(const Pose& pose, Joints* joints, Points* vertices) const {
  const GltfTransforms nodes = world(&pose);
  for (size_t j = 0; j < kJoints; ++j) (*joints)[j] = joint_at(nodes, j);
  if (vertices == nullptr) return;
  *vertices = gltf_mesh(file_, nodes).vertices;
  for (Point& p : *vertices) p = rig_.to_ours(p.cast<double>()).cast<float>();
}

NodeTurns GltfOwnRig::turns(const Pose& pose) const {
  NodeTurns out;
  world(&pose, &out);
  return out;
}

}  // namespace restage
