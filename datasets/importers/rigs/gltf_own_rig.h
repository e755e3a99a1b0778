// A glTF character on its own nodes: posed as a program does that plays the file.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "datasets/importers/rigs/finger_bones.h"
#include "datasets/importers/rigs/gltf_rig.h"
#include "datasets/importers/rigs/twist_bones.h"
#include "nn/geometry/own_rig.h"

namespace restage {

/// Nodes of the fingers, by VRM's list of bones or by their names.
FingerBones rig_fingers(const Gltf& file, const GltfRig& rig);
/// Their turns from the T-pose, our axes, when the nodes are at `world`.
FingerTurns rig_fingers_at(const GltfRig& rig, const FingerBones& bones,
                           const GltfTransforms& world);

/// How the nodes of a pose are turned: what an animation of the file says.
struct NodeTurns {
  /// Numbers of nodes in the file, parents first, and their rotations against their parents.
  std::vector<std::pair<int, Quat>> local;
  /// Numbers of nodes and their translations against their parents, the file's units: the hips, and
  /// bones that hang elsewhere than on the body (GltfRig::carrier).
  std::vector<std::pair<int, Vec3>> moved;
};

/// The formula: a node of joint j has the world rotation D_j T, where D_j is the joint's turn from
/// the T-pose and T the node's world rotation in the T-pose; so of fingers. Only the hips are
/// moved, and bones that hang elsewhere in the file than on the body: they stay where they are on
/// the bone that they belong to. Turns about the line of an arm are shared out (TwistBone). All
/// other nodes keep their local transform of the file.
class GltfOwnRig final : public OwnRig {
 public:
  /// `rig`: find_rig() of `file`.
  GltfOwnRig(Gltf file, GltfRig rig);

  const Mesh& mesh() const override { return mesh_; }
  const Joints& rest() const override { return rest_; }
  SkinWeights weights() const override { return joint_weights(file_, rig_); }
  /// InputError where a bone would leave the bone that it belongs to.
  void place(const Pose& pose, const FingerTurns* fingers, Joints* joints,
             Points* vertices) const override;

  /// Of each vertex in a pose, what takes a small move of it, as the file stores vertices, to the
  /// world, metres.
  std::vector<Mat3> blends(const Pose& pose) const;

  /// `fingers` may be null.
  NodeTurns turns(const Pose& pose, const FingerTurns* fingers) const;
  const Gltf& file() const { return file_; }
  const GltfRig& rig() const { return rig_; }

 private:
  /// From each node to the file's world. Without a pose: the T-pose, hips where the file has them.
  GltfTransforms world(const Pose* pose, const FingerTurns* fingers = nullptr,
                       NodeTurns* turns = nullptr) const;
  std::optional<Mat3> turn_of(size_t node, const Rotations& global,
                              const FingerTurns* fingers) const;
  Vec3 joint_at(const GltfTransforms& world, size_t j) const;
  bool shares_twist(int side) const;  ///< whether the forearm has bones for it
  Vec3 hips_place(const Pose& pose) const;
  Vec3 carried(const GltfTransforms& world, size_t node) const;
  void check_joined(const Joints& joints) const;

  Gltf file_;
  GltfRig rig_;
  std::vector<int> joint_of_;   ///< per node: the joint that turns it, or -1
  std::vector<int> finger_of_;  ///< the same of fingers
  std::vector<TwistBone> twists_;
  Mesh mesh_;
  Joints rest_;
};

}  // namespace restage
