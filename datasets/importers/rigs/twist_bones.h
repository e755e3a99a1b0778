// Turns about a limb's own line, shared out, so that no skin is wrung in one place.
#pragma once

#include <optional>
#include <vector>

#include "datasets/importers/rigs/gltf_rig.h"

namespace restage {

/// A bone of a rig that takes a share of such a turn: it lies between the ends of an upper arm or a
/// forearm, or its name says so (twist, roll), and it is none of the 22 joints.
struct TwistBone {
  int node;
  size_t joint;  ///< of the limb: a shoulder or an elbow
  double along;  ///< 0 at that joint, 1 at the next one
};
/// `rest`: the 22 joints in T-pose, our axes. `joint_of`: per node, the joint that turns it, or -1.
std::vector<TwistBone> find_twist_bones(const Gltf& file, const GltfRig& rig, const Joints& rest,
                                        const std::vector<int>& joint_of);

/// By how much the bone is turned beyond its limb, in the limb's axes. Of a forearm: the share
/// `along` of the hand's turn about it. Of an upper arm: less of its own turn the nearer the
/// shoulder is. `global`: the joints' turns from the T-pose.
Mat3 twist_of(const TwistBone& bone, const Joints& rest, const Rotations& global);

/// A rig without a bone for it: of a hand that is turned by more than 75 degrees about its forearm,
/// the forearm takes two thirds of the rest. `side`: left 0, right 1.
void share_twist(int side, const Joints& rest, Rotations* global);

}  // namespace restage
