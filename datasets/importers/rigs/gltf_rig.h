// Whose bones they are: the rig of a glTF character in terms of the 22 joints, and its T-pose.
#pragma once

#include "datasets/importers/motions/motion_clip.h"
#include "datasets/readers/gltf/gltf.h"

namespace restage {

/// Everything but `scale` and `turn` is in the file's own world.
struct GltfRig {
  /// The pose in which the skin was made. Taken from the inverse bind matrices, because nodes often
  /// rest in the first frame of an animation; without a skin it is where the nodes rest.
  GltfTransforms bind;
  /// The bind pose with upper arms, forearms and hands along the shoulders' line, by the shortest
  /// arcs, where they are more than 5 degrees off; twist and everything else stays.
  GltfTransforms t_pose;
  int hips = 0;                        ///< the node that is moved: the pelvis
  std::array<int, kJoints> node{};     ///< which turns with each of the 22 joints
  std::array<Vec3, kJoints> offset{};  ///< of the joint from its node, T-pose
  std::vector<int> joint;              ///< per node: the nearest of the 22 at it or above it
  /// Per node, what it moves with: its parent in the file, or -1. A bone that does not hang on the
  /// bone above it in the body moves with that one all the same: feet and hands that hang on the
  /// armature, as goals of the maker's IK; thighs that hang on a root.
  std::vector<int> carrier;
  std::vector<int> strays;       ///< such nodes that are none of the 22 joints
  std::vector<int> order;        ///< all nodes, parents and carriers first
  double scale = 1;              ///< metres per unit
  Mat3 turn = Mat3::Identity();  ///< to y up, facing +z

  Vec3 to_ours(const Vec3& x) const { return scale * (turn * x); }
};

/// Finds the joints by VRM's list of bones or as name_joints() does. Adds to the report what was
/// found.
/// Of the options these count, if they are given:
/// - scale; else by the leg (hip-knee-ankle): [0.1, 4) units are metres, as the format has it,
///   longer ones as of recordings (axis.h), giants in centimetres up to 400 and in
///   millimetres up to 4000;
/// - rest.up; else the axis along which the head is furthest from the ankles;
/// - profile; else VRM's list of bones if there is one, else the names and how the bones hang.
/// InputError: no person or two in its bones, a bind pose that does not stand with its arms out, to
/// the front or down, unknown units.
GltfRig find_rig(const Gltf& file, const MotionOptions& options, ImportReport& report);

/// [vertices, 22]: the weights of the file's bones, each counted for rig.joint of its node.
SkinWeights joint_weights(const Gltf& file, const GltfRig& rig);

/// Moves the lowest point to y = 0 and `pelvis` over the origin; returns what was taken off.
Vec3 put_on_floor(Mesh& mesh, const Vec3& pelvis);

/// The rotation in a matrix that may also scale and mirror.
Mat3 rotation_of(const Mat3& m);

/// Positions of the 22 joints in the T-pose, our axes and metres.
Joints t_pose_joints(const GltfRig& rig);

/// The 22 joints when the nodes are at `world`: rotations relative to the T-pose.
PosedSkeleton rig_pose(const GltfRig& rig, const GltfTransforms& world);

}  // namespace restage
