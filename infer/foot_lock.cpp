#include "infer/foot_lock.h"

namespace restage {
namespace {

constexpr double kLands = 0.5, kLifts = 0.3;  // chances
constexpr double kLeak = 0.02, kRelease = 0.25;
constexpr double kFar = 0.06;  // metres

}  // namespace

void FootLock::operator()(const Joints& rest, const std::array<double, 2>& standing, Pose* pose) {
  const Joints joints = forward_kinematics(rest, *pose).joints;
  for (size_t side = 0; side < 2; ++side) {
    Foot& foot = feet_[side];
    const Vec3& said = joints[kFeet[side]];
    if (foot.anchor && (standing[side] < kLifts || (*foot.anchor - said).norm() > kFar))
      foot.anchor.reset();
    else if (!foot.anchor && standing[side] > kLands && foot.offset.norm() < kFar)
      foot.anchor = said + (1 - kRelease) * foot.offset;
    if (foot.anchor) {
      *foot.anchor += kLeak * (said - *foot.anchor);
      foot.offset = *foot.anchor - said;
    } else {
      foot.offset *= 1 - kRelease;
    }
    if (foot.offset.norm() > 1e-6) move_foot(rest, static_cast<int>(side), foot.offset, pose);
  }
}

}  // namespace restage
