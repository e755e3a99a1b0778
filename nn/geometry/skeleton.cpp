#include "nn/geometry/skeleton.h"

#include <cmath>

namespace restage {

PosedSkeleton forward_kinematics(const Joints& rest, const Pose& pose) {
  PosedSkeleton out;
  out.global[0] = pose.local[0];
  out.joints[0] = pose.root;
  for (int j = 1; j < kJoints; ++j) {
    const int p = kParents[j];
    out.joints[j] = out.joints[p] + out.global[p] * (rest[j] - rest[p]);
    out.global[j] = out.global[p] * pose.local[j];
  }
  return out;
}

Rotations to_local(const Rotations& global) {
  Rotations out;
  out[0] = global[0];
  for (int j = 1; j < kJoints; ++j) out[j] = global[kParents[j]].transpose() * global[j];
  return out;
}

Rotations to_global(const Rotations& local) {
  Rotations out;
  out[0] = local[0];
  for (int j = 1; j < kJoints; ++j) out[j] = out[kParents[j]] * local[j];
  return out;
}

Pose between(const Pose& a, const Pose& b, double t) {
  Pose out;
  for (size_t j = 0; j < kJoints; ++j)
    out.local[j] = Quat(a.local[j]).slerp(t, Quat(b.local[j])).toRotationMatrix();
  out.root = (1 - t) * a.root + t * b.root;
  return out;
}

std::array<std::array<double, 4>, kJoints> quaternions(const Rotations& rotations) {
  std::array<std::array<double, 4>, kJoints> out;
  for (size_t j = 0; j < kJoints; ++j) {
    Quat q = Quat(rotations[j]).normalized();
    if (q.w() < 0) q.coeffs() = -q.coeffs();
    out[j] = {q.w(), q.x(), q.y(), q.z()};
  }
  return out;
}

double leg_length(const Joints& x) {
  const auto side = [&](int hip, int knee, int ankle) {
    return (x[hip] - x[knee]).norm() + (x[knee] - x[ankle]).norm();
  };
  return 0.5 * (side(1, 4, 7) + side(2, 5, 8));
}

double trunk_turn(const Joints& a, const Joints& b) {
  const Vec3 one = a[kNeck] - a[kPelvis], other = b[kNeck] - b[kPelvis];
  return std::atan2(one.cross(other).norm(), one.dot(other));
}

Mat3 standing_turn(const Joints& joints) {
  const Vec3 trunk = joints[kNeck] - joints[kPelvis];
  if (!(trunk.norm() > 1e-6)) return Mat3::Identity();
  const Vec3 along = trunk.normalized();
  if (!(std::acos(std::clamp(along.y(), -1.0, 1.0)) > kTiltedTrunk)) return Mat3::Identity();
  return Quat::FromTwoVectors(along, Vec3::UnitY()).toRotationMatrix();
}

namespace {

/// From right to left, by shoulders and hips.
Vec3 across_of(const Joints& x) { return (x[16] - x[17]) + (x[1] - x[2]); }

double heading_of(const Vec3& across) {
  if (across[0] * across[0] + across[2] * across[2] < 1e-12) return 0;
  return std::atan2(-across[2], across[0]);
}

}  // namespace

double heading_angle(const Joints& x) { return heading_of(across_of(x)); }

double Heading::operator()(const Joints& joints) {
  constexpr double kMemory = 0.2;  // seconds
  static const double fresh = 1 - std::exp(-1 / (kFps * kMemory));
  const Vec3 across = across_of(joints);
  across_ = steady_ && !across_.isZero() ? Vec3(across_ + fresh * (across - across_)) : across;
  return heading_of(across_);
}

Mat3 turn_about_y(double angle) {
  return Eigen::AngleAxisd(angle, Vec3::UnitY()).toRotationMatrix();
}

Mat3 shortest_arc(const Vec3& a, const Vec3& b) {
  return Quat::FromTwoVectors(a, b).toRotationMatrix();
}

}  // namespace restage
