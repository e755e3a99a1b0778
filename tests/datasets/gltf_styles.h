// Rigs as users export them.
#pragma once

#include "tests/datasets/gltf_maker.h"

namespace restage::testing {

inline const Mat3 kLyingDown = Eigen::AngleAxisd(-M_PI / 2, Vec3::UnitX()).toRotationMatrix();
inline const Mat3 kTurnedRound = Eigen::AngleAxisd(M_PI, Vec3::UnitY()).toRotationMatrix();

inline Eigen::Affine3d scaled(double scale, const Mat3& turn = Mat3::Identity()) {
  Eigen::Affine3d out = Eigen::Affine3d::Identity();
  out.linear() = scale * turn;
  return out;
}

/// Mixamo through Blender: centimetres and z up below an armature of scale 0.01, bones with axes.
inline RigStyle mixamo_style(const std::string& prefix = "mixamorig:") {
  RigStyle out;
  const char* names[kJoints] = {
      "Hips",        "LeftUpLeg",    "RightUpLeg",    "Spine",    "LeftLeg",     "RightLeg",
      "Spine1",      "LeftFoot",     "RightFoot",     "Spine2",   "LeftToeBase", "RightToeBase",
      "Neck",        "LeftShoulder", "RightShoulder", "Head",     "LeftArm",     "RightArm",
      "LeftForeArm", "RightForeArm", "LeftHand",      "RightHand"};
  for (int j = 0; j < kJoints; ++j) out.names[j] = prefix + names[j];
  out.armature = scaled(0.01, kLyingDown);
  out.bone_axes = true;
  return out;
}

/// Unreal: an A-pose, twist bones, centimetres that nothing scales.
inline RigStyle unreal_style() {
  RigStyle out;
  out.names = {"pelvis",     "thigh_l",    "thigh_r",    "spine_01", "calf_l",     "calf_r",
               "spine_02",   "foot_l",     "foot_r",     "spine_03", "ball_l",     "ball_r",
               "neck_01",    "clavicle_l", "clavicle_r", "head",     "upperarm_l", "upperarm_r",
               "lowerarm_l", "lowerarm_r", "hand_l",     "hand_r"};
  out.world = scaled(100);
  out.armature = scaled(1, kLyingDown);
  out.bone_axes = true;
  out.arms_down = 45;
  out.twist_bones = true;
  out.fps = 24;
  out.keys = 25;
  return out;
}

/// VRM 0: faces -z; nodes have names of their own, the extension says which bone is which.
inline RigStyle vrm_style() {
  RigStyle out;
  for (int j = 0; j < kJoints; ++j) out.names[j] = "J_" + std::to_string(100 + j);
  out.world = scaled(1, kTurnedRound);
  return out;
}

inline const char* const kVrmNames[kJoints] = {
    "hips",         "leftUpperLeg",  "rightUpperLeg", "spine",      "leftLowerLeg", "rightLowerLeg",
    "chest",        "leftFoot",      "rightFoot",     "upperChest", "leftToes",     "rightToes",
    "neck",         "leftShoulder",  "rightShoulder", "head",       "leftUpperArm", "rightUpperArm",
    "leftLowerArm", "rightLowerArm", "leftHand",      "rightHand"};

/// The same with that list, as VRM 0 has it or, without `list`, VRM 1.
inline GlbParts vrm_parts(const KnownCharacter& known, bool list) {
  GlbParts parts = CharacterMaker(known, vrm_style()).parts;
  GltfJson bones;
  for (int j = 0; j < kJoints; ++j) {
    if (list)
      bones.push_back({{"bone", kVrmNames[j]}, {"node", j}});
    else
      bones[kVrmNames[j]] = {{"node", j}};
  }
  parts.root["extensions"][list ? "VRM" : "VRMC_vrm"]["humanoid"]["humanBones"] = bones;
  return parts;
}

}  // namespace restage::testing
