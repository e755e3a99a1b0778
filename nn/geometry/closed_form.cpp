#include "nn/geometry/closed_form.h"

#include <cmath>

namespace restage {
namespace {

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

/// A joint's rotation by its bones alone, and the bone that it can twist about.
struct Swung {
  Mat3 rotation;
  std::optional<Vec3> bone;  ///< posed direction; none at frames, leaves and bones without length
};

/// `global` holds the rotations of its ancestors.
Swung swung(int j, const Rotations& global, const Joints& rest, const Joints& posed) {
  const int parent = kParents[j], child = only_child(j);
  const Mat3 above = parent < 0 ? Mat3(Mat3::Identity()) : global[parent];
  if (j == kPelvis)
    return {turn(rest, posed, kLeftHip, kRightHip, kPelvis, kSpine1, above), std::nullopt};
  if (j == kSpine3)
    return {turn(rest, posed, kLeftCollar, kRightCollar, kSpine3, kNeck, above), std::nullopt};
  if (child < 0) return {above, std::nullopt};
  const Vec3 bone = above * (rest[child] - rest[j]), wanted = posed[child] - posed[j];
  if (!(bone.norm() > kTiny && wanted.norm() > kTiny)) return {above, std::nullopt};
  return {shortest_arc(bone, wanted) * above, wanted.normalized()};
}

/// Angle of the part of a rotation that turns about a direction, -pi to pi.
double twist_about(const Vec3& axis, const Mat3& rotation) {
  const Quat q(rotation);
  const double along = q.vec().dot(axis);
  if (std::hypot(along, q.w()) < 1e-6) return 0;  // half a turn about something else
  return std::remainder(2 * std::atan2(along, q.w()), 2 * M_PI);
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
  for (int j = 0; j < kJoints; ++j) global[j] = swung(j, global, rest, posed).rotation;
  return global;
}

TwistReading read_twist(const Joints& rest, const Joints& posed, const Rotations& measured) {
  Rotations global;
  TwistReading out;
  for (int j = 0; j < kJoints; ++j) {
    const Swung own = swung(j, global, rest, posed);
    global[j] = own.rotation;
    if (own.bone) {
      out.twist[j] = twist_about(*own.bone, measured[j] * own.rotation.transpose());
      global[j] = Eigen::AngleAxisd(out.twist[j], *own.bone) * own.rotation;
    }
    out.beyond[j] = global[j].transpose() * measured[j];
  }
  return out;
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

std::vector<Joints> rest_pose_joints(const std::vector<Joints>& source, const Joints& target_rest) {
  std::vector<Joints> joints;
  for (const Vec3& pelvis : pelvis_path(source, target_rest)) {
    Joints& frame_joints = joints.emplace_back(target_rest);
    for (Vec3& joint : frame_joints) joint += pelvis - target_rest[kPelvis];
  }
  return joints;
}

}  // namespace restage
