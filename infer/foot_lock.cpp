#include "infer/foot_lock.h"

namespace restage {
namespace {

constexpr double kLands = 0.5;     // a foot begins to stand above this chance
constexpr double kLifts = 0.3;     // and is lifted below this one
constexpr double kLeak = 0.02;     // share of the offset that goes in a frame while a foot is held
constexpr double kRelease = 0.25;  // the same while a foot is not held
constexpr double kSettle = 0.25;   // share of the way to the floor that a held foot goes
constexpr double kFar = 0.06;      // metres: a foot is not held this far from the network's

}  // namespace

void FootLock::operator()(const Joints& rest, const std::array<double, 2>& standing, Pose* pose,
                          const std::optional<std::array<double, 2>>& above) {
  const Joints joints = forward_kinematics(rest, *pose).joints;
  for (size_t side = 0; side < 2; ++side) {
    Foot& foot = feet_[side];
    const Vec3& said = joints[kFeet[side]];
    if (foot.anchor && (standing[side] < kLifts || (*foot.anchor - said).norm() > kFar))
      foot.anchor.reset();
    else if (!foot.anchor && standing[side] > kLands && foot.offset.norm() < kFar)
      foot.anchor = said + (1 - kRelease) * foot.offset;
    if (foot.anchor) {
      const double height = foot.anchor->y();
      *foot.anchor += kLeak * (said - *foot.anchor);
      if (above) foot.anchor->y() = height + kSettle * (said.y() - (*above)[side] - height);
      foot.offset = *foot.anchor - said;
    } else {
      foot.offset *= 1 - kRelease;
    }
    if (foot.offset.norm() > 1e-6) move_foot(rest, static_cast<int>(side), foot.offset, pose);
  }
}

}  // namespace restage
