// Two simple motions written as BVH in many styles. In the first every joint turns about a fixed
// axis at a constant rate and the hips move on a line, so slerp and linear interpolation are exact
// at any frame rate. In the second a toy walks: knees bend backwards, elbows forwards, arms hang.
// And what the families of BVH files have in common: names of bones, and LAFAN1's rest pose.
#pragma once

#include <algorithm>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "datasets/importers/rigs/profiles.h"
#include "nn/geometry/skeleton.h"

namespace restage::bvh_test {

inline const Joints& rest() {
  static const Joints value = [] {
    Joints x;
    const double m[kJoints][3] = {
        {0, .95, 0},     {.09, .9, 0},     {-.09, .9, 0},   {0, 1.05, 0},     {.1, .5, .01},
        {-.1, .5, .01},  {0, 1.18, 0},     {.1, .08, -.02}, {-.1, .08, -.02}, {0, 1.3, 0},
        {.11, .02, .12}, {-.11, .02, .12}, {0, 1.45, 0},    {.05, 1.4, 0},    {-.05, 1.4, 0},
        {0, 1.55, .02},  {.18, 1.4, 0},    {-.18, 1.4, 0},  {.45, 1.4, 0},    {-.45, 1.4, 0},
        {.7, 1.4, 0},    {-.7, 1.4, 0}};
    for (int j = 0; j < kJoints; ++j) x[j] = Vec3(m[j][0], m[j][1], m[j][2]);
    return x;
  }();
  return value;
}

inline constexpr const char* kMixamo[kJoints] = {
    "mixamorig:Hips",        "mixamorig:LeftUpLeg",    "mixamorig:RightUpLeg",
    "mixamorig:Spine",       "mixamorig:LeftLeg",      "mixamorig:RightLeg",
    "mixamorig:Spine1",      "mixamorig:LeftFoot",     "mixamorig:RightFoot",
    "mixamorig:Spine2",      "mixamorig:LeftToeBase",  "mixamorig:RightToeBase",
    "mixamorig:Neck",        "mixamorig:LeftShoulder", "mixamorig:RightShoulder",
    "mixamorig:Head",        "mixamorig:LeftArm",      "mixamorig:RightArm",
    "mixamorig:LeftForeArm", "mixamorig:RightForeArm", "mixamorig:LeftHand",
    "mixamorig:RightHand"};

/// No joint turned.
inline Rotations unturned() {
  Rotations out;
  out.fill(Mat3::Identity());
  return out;
}

struct Style {
  std::string rotations = "ZXY", root_rotations = "ZYX";  ///< channel order
  bool rotations_first = false;  ///< the root's rotation channels before its positions
  bool reversed = false;         ///< children in the opposite order
  bool all_positions = false;    ///< every joint has position channels
  bool wrapped = false;          ///< the hips hang from a still root joint
  double unit = 0.01;            ///< metres per unit
  bool z_up = false;
  int quarter_turns = 0;  ///< the rest pose faces another way
  double fps = 120;
  int frames = 121;
  bool t_pose_first = false;    ///< frame 0 is the rest pose
  Rotations bind = unturned();  ///< global frames of the zero pose; identity: a T-pose
  std::vector<std::string> names = {kMixamo, kMixamo + kJoints};
  bool moving_root = false;       ///< with `wrapped`: the root has six channels, all 0
  bool walks = false;             ///< the second motion
  std::vector<int> without = {};  ///< joints left out (their children hang from their parents)
};

/// Local rotation of joint j at time t.
inline Mat3 turn(int j, double t) {
  const Vec3 axis = Vec3(1 + j % 3, (j * 7) % 5 - 2, j % 2 ? 1.5 : -0.7).normalized();
  return Eigen::AngleAxisd((0.3 + 0.05 * j) * t, axis).toRotationMatrix();
}
inline Vec3 hips(double t) { return Vec3(0.4 * t, 0.95 - 0.1 * t, 1.1 * t); }

/// The same of a toy that walks two steps a second. At any time its feet are level.
inline Mat3 walk_turn(int j, double t) {
  const auto about = [](const Vec3& axis, double angle) {
    return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
  };
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  const double swing = std::sin(2 * M_PI * t), bend = 0.4 * std::cos(2 * M_PI * t);
  const double s = j == 1 || j == 4 || j == 7 || j == 16 || j == 18 ? 1 : -1;  // left or right
  if (j == 0) return about(y, 0.5 * t);
  if (j == 1 || j == 2) return about(x, -0.4 * s * swing);
  if (j == 4 || j == 5) return about(x, 0.5 + s * bend);
  if (j == 7 || j == 8) return about(x, 0.4 * s * swing - 0.5 - s * bend);
  if (j == 3 || j == 6 || j == 9) return about(y, 0.06 * swing);
  if (j == 15) return about(x, 0.1 * std::sin(4 * M_PI * t));
  if (j == 16 || j == 17) return about(x, 0.5 * s * swing) * about(z, -1.3 * s);
  if (j == 18 || j == 19) return about(y, -s * (0.5 + 0.2 * swing));
  return Mat3::Identity();
}
inline PosedSkeleton truth(double t, bool walks = false) {
  Pose pose;
  for (int j = 0; j < kJoints; ++j) pose.local[j] = walks ? walk_turn(j, t) : turn(j, t);
  pose.root = hips(t);
  return forward_kinematics(rest(), pose);
}

/// From our axes to the file's.
inline Mat3 to_file(const Style& style) {
  const Mat3 yaw =
      Eigen::AngleAxisd(style.quarter_turns * M_PI / 2, Vec3::UnitY()).toRotationMatrix();
  Mat3 up = Mat3::Identity();
  if (style.z_up) up << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return up * yaw;
}

inline std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, " %.9g", value);
  return text;
}

inline std::string vector_text(const Vec3& v) {
  return number(v.x()) + number(v.y()) + number(v.z());
}

inline std::string text(const Style& style) {
  const Mat3 axes = to_file(style);
  const auto has = [&](int j) {
    for (const int k : style.without)
      if (j == k) return false;
    return true;
  };
  const auto parent = [&](int j) {
    int p = kParents[j];
    while (p >= 0 && !has(p)) p = kParents[p];
    return p;
  };
  std::vector<int> order;  // joints as written
  std::string out = "HIERARCHY\n";
  const auto channels = [](const std::string& positions, const std::string& rotations, bool first) {
    std::string p, r;
    for (const char c : positions) p += std::string(" ") + c + "position";
    for (const char c : rotations) r += std::string(" ") + c + "rotation";
    return "CHANNELS " + std::to_string(positions.size() + rotations.size()) +
           (first ? r + p : p + r) + "\n";
  };
  const std::function<void(int)> write = [&](int j) {
    order.push_back(j);
    const bool root = j == 0;
    const Vec3 offset = root ? Vec3::Zero()
                             : Vec3(axes * style.bind[parent(j)].transpose() *
                                    (rest()[j] - rest()[parent(j)]) / style.unit);
    out += (root && !style.wrapped ? "ROOT " : "JOINT ") + style.names[static_cast<size_t>(j)] +
           "\n{\nOFFSET" + vector_text(offset) + "\n";
    out += channels(root || style.all_positions ? "XYZ" : "",
                    root ? style.root_rotations : style.rotations, style.rotations_first);
    std::vector<int> children;
    for (int k = 1; k < kJoints; ++k)
      if (has(k) && parent(k) == j) children.push_back(k);
    if (style.reversed) std::reverse(children.begin(), children.end());
    for (const int k : children) write(k);
    if (children.empty()) {
      const Vec3 end = j == 7 || j == 8 ? Vec3(rest()[j + 3] - rest()[j]) : Vec3(0, 0.05, 0);
      out += "End Site\n{\nOFFSET" +
             vector_text(axes * style.bind[j].transpose() * end / style.unit) + "\n}\n";
    }
    out += "}\n";
  };
  if (style.wrapped)
    out += "ROOT reference\n{\nOFFSET 0 0 0\n" +
           channels(style.moving_root ? "XYZ" : "", style.moving_root ? "ZYX" : "", false);
  write(0);
  if (style.wrapped) out += "}\n";
  out += "MOTION\nFrames: " + std::to_string(style.frames) +
         "\nFrame Time:" + number(1 / style.fps) + "\n";

  const auto axis = [](char c) { return c - 'X'; };
  for (int f = 0; f < style.frames; ++f) {
    const bool still = style.t_pose_first && f == 0;
    const double t = still ? 0 : (f - (style.t_pose_first ? 1 : 0)) / style.fps;
    if (style.moving_root) out += " 0 0 0 0 0 0";
    for (const int j : order) {
      Mat3 local = still ? Mat3(Mat3::Identity()) : style.walks ? walk_turn(j, t) : turn(j, t);
      // A joint left out takes its turns with it: the next one above is written as it is.
      const int p = parent(j);
      const Mat3 bind_parent = p < 0 ? Mat3::Identity() : style.bind[p];
      local = axes * bind_parent.transpose() * local * style.bind[j] * axes.transpose();
      const std::string& wanted = j == 0 ? style.root_rotations : style.rotations;
      const Vec3 angles =
          local.eulerAngles(axis(wanted[0]), axis(wanted[1]), axis(wanted[2])) * 180 / M_PI;
      std::string position;
      if (j == 0)
        position = vector_text(axes * (still ? rest()[0] : hips(t)) / style.unit);
      else if (style.all_positions)
        position =
            vector_text(axes * style.bind[p].transpose() * (rest()[j] - rest()[p]) / style.unit);
      out +=
          style.rotations_first ? vector_text(angles) + position : position + vector_text(angles);
    }
    out += "\n";
  }
  return out;
}

/// Names of a profile, as a file of the family has them.
inline std::vector<std::string> names_of(const std::string& profile,
                                         const std::string& prefix = "") {
  std::vector<std::string> out;
  const Profile found = find_profile(profile);
  for (const auto& bones : found.bones) out.push_back(bones.empty() ? "none" : prefix + bones[0]);
  return out;
}

/// Every bone along +x at zero rotations, twisted as LAFAN1's are.
inline Rotations bones_along_x() {
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  const auto frame = [](const Vec3& bone, const Vec3& second) {
    Mat3 m;
    m << bone, second, bone.cross(second);
    return m;
  };
  Rotations out;
  out.fill(frame(y, z));  // the trunk: up, front, left
  for (const int j : {1, 2, 4, 5}) out[j] = frame(-y, z);
  for (const int j : {13, 16, 18, 20}) out[j] = frame(x, -z);
  for (const int j : {14, 17, 19, 21}) out[j] = frame(-x, -z);
  for (const int j : {7, 8, 10, 11}) {
    const Vec3 foot = (rest()[10] - rest()[7]).normalized();
    const Vec3 level(0, foot.y(), std::sqrt(1 - foot.y() * foot.y()));
    out[j] = frame(level, Vec3(0, level.z(), -level.y()));
  }
  return out;
}

}  // namespace restage::bvh_test
