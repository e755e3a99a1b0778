// How other programs call, turn and hang the bones of a skeleton, for targets that have none.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "nn/geometry/skeleton.h"

namespace restage {

/// A node without a joint of ours: the end of a bone, or a hand of SMPL. Its axes are its parent's.
struct ExtraNode {
  std::string name;
  int parent;  ///< a joint
  Vec3 place;  ///< T-pose, world, metres
};

struct RigConvention {
  std::string name;
  std::array<std::string, kJoints> names;
  Rotations axes;                ///< of the bones in T-pose, in the world
  std::vector<ExtraNode> extra;  ///< behind the joints
  std::string root;              ///< of a node at the origin that carries the pelvis; empty: none
};

/// "restage", "smpl", "mixamo", "vrm", "unreal".
const std::vector<std::string>& rig_conventions();

/// The hierarchy is ours in all of them (docs/animators.md). Axes in T-pose, facing +z:
/// - restage, smpl, vrm: the world's. smpl has 24 joints, with hands.
/// - mixamo: y along the bone; z to the front, of feet and toes x to the left.
/// - unreal: x along spine, neck, head and left arm, x up in pelvis, left leg and left foot, y to
///   the front (of arms down); on the right side all axes are the mirrored ones, inverted.
/// `rest`: the joints in T-pose; `top`: the height of the head's top, metres. InputError for
/// another name.
RigConvention rig_convention(const std::string& name, const Joints& rest, double top);

/// InputError for another name than those of rig_conventions().
void check_convention(const std::string& name);

}  // namespace restage
