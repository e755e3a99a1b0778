#include "datasets/sampling/augment.h"

namespace restage {
namespace {

Mat3 turn(const Augmentation& a) {
  return Eigen::AngleAxisd(a.heading, Vec3::UnitY()).toRotationMatrix();
}

Vec3 flipped(const Vec3& x) { return Vec3(-x.x(), x.y(), x.z()); }

/// M R M with M = diag(-1, 1, 1).
Mat3 flipped(Mat3 r) {
  for (const int i : {1, 2}) {
    r(0, i) = -r(0, i);
    r(i, 0) = -r(i, 0);
  }
  return r;
}

/// Each side's under the other's name.
Rotations flipped(const Rotations& of) {
  Rotations out;
  for (int j = 0; j < kJoints; ++j) out[j] = flipped(of[kMirror[j]]);
  return out;
}

}  // namespace

Augmentation draw_augmentation(Rng& rng, double heading_range, bool mirror) {
  // Both are drawn whether wanted or not, so that a switch does not change what follows.
  const double heading = rng.uniform(-1.0, 1.0), side = rng.uniform();
  return {heading * heading_range, mirror && side < 0.5};
}

Vec3 augmented(const Augmentation& a, const Vec3& x) {
  const Vec3 turned = turn(a) * x;
  return a.mirror ? flipped(turned) : turned;
}

void augment(const Augmentation& a, Points& points) {
  const Eigen::Matrix3f r = turn(a).cast<float>();
  for (Point& p : points) {
    p = r * p;
    if (a.mirror) p.x() = -p.x();
  }
}

Joints augmented(const Augmentation& a, const Joints& posed) {
  const Mat3 r = turn(a);
  Joints turned;
  for (int j = 0; j < kJoints; ++j) turned[j] = r * posed[j];
  return augmented_rest(a, turned);
}

Joints augmented_rest(const Augmentation& a, const Joints& rest) {
  if (!a.mirror) return rest;
  Joints out;
  for (int j = 0; j < kJoints; ++j) out[j] = flipped(rest[kMirror[j]]);
  return out;
}

Pose augmented(const Augmentation& a, const Pose& pose) {
  const Mat3 r = turn(a);
  Pose out = pose;
  out.local[0] = r * pose.local[0];
  out.root = r * pose.root;
  if (!a.mirror) return out;
  out.local = flipped(out.local);
  out.root = flipped(out.root);
  return out;
}

Rotations augmented(const Augmentation& a, const Rotations& global) {
  const Mat3 r = turn(a);
  Rotations out;
  for (int j = 0; j < kJoints; ++j) out[j] = r * global[j];
  return a.mirror ? flipped(out) : out;
}

}  // namespace restage
