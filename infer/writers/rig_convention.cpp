#include "infer/writers/rig_convention.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "autograd/base/error.h"

namespace restage {
namespace {

constexpr double kHand = 0.35;  // of the forearm: from the wrist to the hand's joint
constexpr double kToe = 0.5;    // of the foot: from the toes' joint to their end

using Names = std::array<std::string, kJoints>;

Names plain_names() {
  Names out;
  for (size_t j = 0; j < kJoints; ++j) out[j] = std::string(kJointNames[j]);
  return out;
}

// In the order of kJointNames.
const Names kMixamo = {"Hips",        "LeftUpLeg",    "RightUpLeg", "Spine",        "LeftLeg",
                       "RightLeg",    "Spine1",       "LeftFoot",   "RightFoot",    "Spine2",
                       "LeftToeBase", "RightToeBase", "Neck",       "LeftShoulder", "RightShoulder",
                       "Head",        "LeftArm",      "RightArm",   "LeftForeArm",  "RightForeArm",
                       "LeftHand",    "RightHand"};
const Names kVrm = {
    "hips",         "leftUpperLeg",  "rightUpperLeg", "spine",      "leftLowerLeg", "rightLowerLeg",
    "chest",        "leftFoot",      "rightFoot",     "upperChest", "leftToes",     "rightToes",
    "neck",         "leftShoulder",  "rightShoulder", "head",       "leftUpperArm", "rightUpperArm",
    "leftLowerArm", "rightLowerArm", "leftHand",      "rightHand"};
const Names kUnreal = {"pelvis", "thigh_l",    "thigh_r",    "spine_01",   "calf_l",
                       "calf_r", "spine_02",   "foot_l",     "foot_r",     "spine_03",
                       "ball_l", "ball_r",     "neck_01",    "clavicle_l", "clavicle_r",
                       "head",   "upperarm_l", "upperarm_r", "lowerarm_l", "lowerarm_r",
                       "hand_l", "hand_r"};

/// The joint that a bone points to; -1: it ends there.
int next_joint(int joint) {
  constexpr std::array<int, kJoints> kNext = {3,  4,  5,  6,  7,  8,  9,  10, 11, 12, -1,
                                              -1, 15, 16, 17, -1, 18, 19, 20, 21, -1, -1};
  return kNext[static_cast<size_t>(joint)];
}

/// Where a bone points; the last of a chain as the one before.
Vec3 direction(const Joints& rest, int joint) {
  if (joint == kHead) return Vec3::UnitY();
  if (joint == kLeftFoot || joint == kRightFoot) return Vec3::UnitZ();
  const int next = next_joint(joint);
  const Vec3 bone = next >= 0
                        ? Vec3(rest[static_cast<size_t>(next)] - rest[static_cast<size_t>(joint)])
                        : Vec3(rest[static_cast<size_t>(joint)] -
                               rest[static_cast<size_t>(kParents[static_cast<size_t>(joint)])]);
  return bone.norm() > 1e-6 ? Vec3(bone.normalized()) : Vec3(Vec3::UnitY());
}

bool is_foot(int joint) {
  return joint == kLeftAnkle || joint == kRightAnkle || joint == kLeftFoot || joint == kRightFoot;
}

Mat3 along_y(const Vec3& bone, bool foot) {
  Mat3 out;
  out.col(1) = bone;
  if (foot) {
    out.col(2) = Vec3::UnitX().cross(bone).normalized();
    out.col(0) = bone.cross(out.col(2));
  } else {
    out.col(0) = bone.cross(Vec3::UnitZ()).normalized();
    out.col(2) = out.col(0).cross(bone);
  }
  return out;
}

bool is_right(int joint) { return kMirror[static_cast<size_t>(joint)] < joint; }

bool is_leg(int joint) {
  return joint == kLeftHip || joint == kRightHip || joint == kLeftKnee || joint == kRightKnee ||
         is_foot(joint);
}

Mat3 unreal_axes(const Joints& rest, int joint) {
  if (is_right(joint)) {
    // Mirrored and inverted: M(x, y, z) = (-x, y, z), and a turn again.
    Mat3 out = unreal_axes(rest, kMirror[static_cast<size_t>(joint)]);
    out.bottomRows<2>() *= -1;
    return out;
  }
  const bool arm = rest[static_cast<size_t>(joint)].x() > 1e-6 && !is_leg(joint);
  const Vec3 x = joint == kPelvis || is_foot(joint) ? Vec3(Vec3::UnitY())
                 : is_leg(joint)                    ? Vec3(-direction(rest, joint))
                                                    : direction(rest, joint);
  const Vec3 front = arm && std::abs(x.x()) > 0.5 ? Vec3(-Vec3::UnitY()) : Vec3(Vec3::UnitZ());
  Mat3 out;
  out.col(0) = x;
  out.col(2) = x.cross(front).normalized();
  out.col(1) = out.col(2).cross(x);
  return out;
}

ExtraNode end_of(const std::string& name, int joint, const Vec3& place) {
  return {name, joint, place};
}

void make_mixamo(RigConvention& out, const Joints& rest, double top) {
  for (size_t j = 0; j < kJoints; ++j) {
    out.names[j] = "mixamorig:" + kMixamo[j];
    out.axes[j] = along_y(direction(rest, static_cast<int>(j)), is_foot(static_cast<int>(j)));
  }
  out.extra.push_back(
      end_of("mixamorig:HeadTop_End", kHead,
             {rest[kHead].x(), std::max(top, rest[kHead].y() + 0.01), rest[kHead].z()}));
  for (const auto& [name, toes, ankle] :
       {std::tuple{"mixamorig:LeftToe_End", kLeftFoot, kLeftAnkle},
        std::tuple{"mixamorig:RightToe_End", kRightFoot, kRightAnkle}}) {
    const Vec3 foot = rest[static_cast<size_t>(toes)] - rest[static_cast<size_t>(ankle)];
    out.extra.push_back(
        end_of(name, toes, rest[static_cast<size_t>(toes)] + kToe * foot.norm() * Vec3::UnitZ()));
  }
}

void make_smpl(RigConvention& out, const Joints& rest) {
  for (const auto& [name, wrist, elbow] : {std::tuple{"left_hand", kLeftWrist, kLeftElbow},
                                           std::tuple{"right_hand", kRightWrist, kRightElbow}}) {
    const Vec3 forearm = rest[static_cast<size_t>(wrist)] - rest[static_cast<size_t>(elbow)];
    out.extra.push_back(end_of(name, wrist, rest[static_cast<size_t>(wrist)] + kHand * forearm));
  }
}

}  // namespace

const std::vector<std::string>& rig_conventions() {
  static const std::vector<std::string> names = {"restage", "smpl", "mixamo", "vrm", "unreal"};
  return names;
}

void check_convention(const std::string& name) {
  const auto& all = rig_conventions();
  if (std::find(all.begin(), all.end(), name) == all.end())
    throw InputError("", "{skeleton} '" + name + "' is unknown",
                     "use restage, smpl, mixamo, vrm or unreal");
}

RigConvention rig_convention(const std::string& name, const Joints& rest, double top) {
  check_convention(name);
  RigConvention out;
  out.name = name;
  out.names = name == "vrm" ? kVrm : name == "unreal" ? kUnreal : plain_names();
  out.axes.fill(Mat3::Identity());
  if (name == "mixamo") make_mixamo(out, rest, top);
  if (name == "smpl") make_smpl(out, rest);
  if (name != "unreal") return out;
  out.root = "root";
  for (int j = 0; j < kJoints; ++j) out.axes[static_cast<size_t>(j)] = unreal_axes(rest, j);
  return out;
}

}  // namespace restage
