// Poses as messages of the VMC protocol (https://protocol.vmc.info, "Marionette"): OSC over UDP,
// which programs that show VRM characters listen to. Axes are Unity's: left-handed, metres, y up,
// the character faces +z and its left is -x.
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "infer/live/place.h"
#include "nn/geometry/skeleton.h"

namespace restage::live {

/// Our joints' names among Unity's HumanBodyBones, by joint.
extern const std::array<std::string_view, kJoints> kUnityBones;

/// Which of the 22 joints a character has a bone for. Without one for the pelvis it has none.
using BoneSet = std::array<bool, kJoints>;

/// A bone as the protocol has it: place and rotation against the parent among the bones that are
/// sent, in Unity's axes. In the T-pose all rotations are the identity.
struct VmcBone {
  std::string_view name;
  Eigen::Vector3f position;     ///< metres
  Eigen::Quaternionf rotation;  ///< w >= 0
};

/// The bones of `sent` in a pose, parents first. `rest`: the joints in T-pose, metres, ours. The
/// hips' position is the pelvis's place in the world; the turns of joints that are not sent go into
/// the bones below them.
std::vector<VmcBone> vmc_bones(const Joints& rest, const Pose& pose, const BoneSet& sent);

class VmcSender {
 public:
  /// `to`: resolved().
  VmcSender(const Place& to, const Joints& rest, const BoneSet& sent);
  /// One bundle: /VMC/Ext/OK, /VMC/Ext/T, /VMC/Ext/Root/Pos (always the origin) and
  /// /VMC/Ext/Bone/Pos for every bone. `seconds`: since the stream began. `tracked`: whether
  /// somebody is seen now, as /VMC/Ext/OK says since version 2.7 of the protocol (loaded,
  /// calibrated, in the usual mode, tracked). Returns why it could not be sent; empty: it has been
  /// handed to the socket.
  std::string send(const Pose& pose, double seconds, bool tracked = true);

 private:
  Datagrams to_;
  Joints rest_;
  BoneSet sent_;
  std::vector<char> bytes_;
};

}  // namespace restage::live
