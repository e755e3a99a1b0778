#include "nn/geometry/closed_form.h"

namespace restage {
namespace {

constexpr int kPelvis = 0, kLeftHip = 1, kRightHip = 2, kSpine1 = 3, kSpine3 = 9, kNeck = 12,
              kLeftCollar = 13, kRightCollar = 14;
constexpr double kTiny = 1e-12;

/// Columns: across, the part of `up` at right angles to it, and their cross product. Empty if the
/// two directions do not span a plane.
std::optional<Mat3> frame(const Vec3& across, const Vec3& up) {
  const Vec3 x = across.normalized();
  const Vec3 y = up - x.dot(up) * x;
  if (!(across.norm() > kTiny) || !(y.norm() > kTiny * std::max(1.0, up.norm())))
    return std::nullopt;
  Mat3 m;
  m << x, y.normalized(), x.cross(y.normalized());
  return m;
}

Mat3 turn(const Joints& rest, const Joints& posed, int left, int right, int from, int to,
          const Mat3& otherwise) {
  const auto a = frame(rest[left] - rest[right], rest[to] - rest[from]);
  const auto b = frame(posed[left] - posed[right], posed[to] - posed[from]);
  return a && b ? Mat3(*b * a->transpose()) : otherwise;
}

/// The only child of a joint; -1 for leaves. (Pelvis and spine3 have several and use frames.)
int only_child(int joint) {
  for (int j = joint + 1; j < kJoints; ++j)
    if (kParents[j] == joint) return j;
  return -1;
}

std::vector<Vec3> pelvis_path(const std::vector<Joints>& source, const Joints& target_rest) {
  std::vector<Vec3> path;
  if (source.empty()) return path;
  const double scale = trajectory_scale(source.front(), target_rest);
  for (const Joints& joints : source) path.push_back(scale * joints[kPelvis]);
  return path;
}

}  // namespace

Rotations closed_form_rotations(const Joints& rest, const Joints& posed) {
  Rotations global;
  for (int j = 0; j < kJoints; ++j) {
    const int parent = kParents[j], child = only_child(j);
    global[j] = parent < 0 ? Mat3::Identity() : global[parent];
    if (j == kPelvis) {
      global[j] = turn(rest, posed, kLeftHip, kRightHip, kPelvis, kSpine1, global[j]);
    } else if (j == kSpine3) {
      global[j] = turn(rest, posed, kLeftCollar, kRightCollar, kSpine3, kNeck, global[j]);
    } else if (child >= 0) {
      const Vec3 bone = global[j] * (rest[child] - rest[j]), wanted = posed[child] - posed[j];
      if (bone.norm() > kTiny && wanted.norm() > kTiny)
        global[j] = shortest_arc(bone, wanted) * global[j];
    }
  }
  return global;
}

double trajectory_scale(const Joints& source, const Joints& target_rest) {
  const double length = leg_length(source);
  return length > kTiny ? leg_length(target_rest) / length : 1.0;
}

std::vector<Pose> closed_form(const std::vector<Joints>& source, const Joints& target_rest,
                              const std::optional<Joints>& source_rest) {
  const std::vector<Vec3> path = pelvis_path(source, target_rest);
  std::vector<Pose> poses(source.size());
  for (size_t f = 0; f < source.size(); ++f) {
    const Joints& rest = source_rest ? *source_rest : target_rest;
    poses[f].local = to_local(closed_form_rotations(rest, source[f]));
    poses[f].root = path[f];
  }
  return poses;
}

std::vector<Joints> closed_form_joints(const std::vector<Joints>& source,
                                       const Joints& target_rest) {
  std::vector<Joints> joints;
  for (const Pose& pose : closed_form(source, target_rest))
    joints.push_back(forward_kinematics(target_rest, pose).joints);
  return joints;
}

std::vector<Joints> rest_pose_joints(const std::vector<Joints>& source, const Joints& target_rest) {
  std::vector<Joints> joints;
  for (const Vec3& pelvis : pelvis_path(source, target_rest)) {
    Joints& frame_joints = joints.emplace_back(target_rest);
    for (Vec3& joint : frame_joints) joint += pelvis - target_rest[kPelvis];
  }
  return joints;
}

}  // namespace restage
