#include "infer/live/vmc.h"

#include <lo/lo.h>

#include "autograd/base/error.h"

namespace restage::live {

const std::array<std::string_view, kJoints> kUnityBones = {
    "Hips",         "LeftUpperLeg",  "RightUpperLeg", "Spine",      "LeftLowerLeg", "RightLowerLeg",
    "Chest",        "LeftFoot",      "RightFoot",     "UpperChest", "LeftToes",     "RightToes",
    "Neck",         "LeftShoulder",  "RightShoulder", "Head",       "LeftUpperArm", "RightUpperArm",
    "LeftLowerArm", "RightLowerArm", "LeftHand",      "RightHand"};

namespace {

// Unity's x points to the character's right: everything is mirrored in the plane x = 0.
Eigen::Vector3f unity(const Vec3& v) { return Vec3(-v.x(), v.y(), v.z()).cast<float>(); }
Eigen::Quaternionf unity(const Mat3& turn) {
  const Quat q(turn);
  const double sign = q.w() < 0 ? -1 : 1;
  return Quat(sign * q.w(), sign * q.x(), -sign * q.y(), -sign * q.z()).cast<float>();
}

/// The message is freed by whoever frees its bundle.
void add_place(lo_bundle bundle, const char* path, std::string_view name, const Eigen::Vector3f& p,
               const Eigen::Quaternionf& q) {
  lo_message message = lo_message_new();
  lo_message_add(message, "sfffffff", std::string(name).c_str(), double{p.x()}, double{p.y()},
                 double{p.z()}, double{q.x()}, double{q.y()}, double{q.z()}, double{q.w()});
  lo_bundle_add_message(bundle, path, message);
}

}  // namespace

std::vector<VmcBone> vmc_bones(const Joints& rest, const Pose& pose, const BoneSet& sent) {
  const Rotations global = to_global(pose.local);
  std::vector<VmcBone> out;
  for (size_t j = 0; j < kJoints; ++j) {
    if (!sent[j]) continue;
    int parent = kParents[j];
    while (parent >= 0 && !sent[static_cast<size_t>(parent)])
      parent = kParents[static_cast<size_t>(parent)];
    const auto p = static_cast<size_t>(parent);
    if (parent < 0)
      out.push_back({kUnityBones[j], unity(pose.root), unity(global[j])});
    else
      out.push_back({kUnityBones[j], unity(Vec3(rest[j] - rest[p])),
                     unity(Mat3(global[p].transpose() * global[j]))});
  }
  return out;
}

VmcSender::VmcSender(const Place& to, const Joints& rest, const BoneSet& sent)
    : to_(to), rest_(rest), sent_(sent) {
  if (!sent_[kPelvis]) throw WorkError("a character without hips cannot be sent");
}

std::string VmcSender::send(const Pose& pose, double seconds, bool tracked) {
  lo_bundle bundle = lo_bundle_new(LO_TT_IMMEDIATE);
  lo_message loaded = lo_message_new(), time = lo_message_new();
  constexpr int kLoaded = 1, kCalibrated = 3, kUsualMode = 0;
  lo_message_add(loaded, "iiii", kLoaded, kCalibrated, kUsualMode, tracked ? 1 : 0);
  lo_bundle_add_message(bundle, "/VMC/Ext/OK", loaded);
  lo_message_add(time, "f", seconds);
  lo_bundle_add_message(bundle, "/VMC/Ext/T", time);
  add_place(bundle, "/VMC/Ext/Root/Pos", "root", Eigen::Vector3f::Zero(),
            Eigen::Quaternionf::Identity());
  for (const VmcBone& bone : vmc_bones(rest_, pose, sent_))
    add_place(bundle, "/VMC/Ext/Bone/Pos", bone.name, bone.position, bone.rotation);
  bytes_.resize(lo_bundle_length(bundle));
  lo_bundle_serialise(bundle, bytes_.data(), nullptr);
  lo_bundle_free_recursive(bundle);
  return to_.send(bytes_);
}

}  // namespace restage::live
