#include "nn/geometry/contact.h"

#include <algorithm>
#include <cmath>

namespace restage {
namespace {

constexpr double kStill = 0.15 / kFps, kHigh = 0.1;  // metres per frame, metres
constexpr size_t kAround = 30;
constexpr double kStretched = 0.9995;  // of a leg's length: farther it does not reach

}  // namespace

std::vector<std::array<bool, 2>> standing_feet(const std::vector<Joints>& performance) {
  const size_t n = performance.size();
  std::vector<std::array<bool, 2>> out(n, {false, false});
  for (size_t t = 0; t < n; ++t) {
    double lowest = performance[t][kFeet[0]].y();
    for (size_t i = t - std::min(t, kAround); i < std::min(n, t + kAround + 1); ++i)
      for (const int foot : kFeet) lowest = std::min(lowest, performance[i][foot].y());
    for (size_t side = 0; side < 2; ++side) {
      const int foot = kFeet[side];
      const auto moved = [&](size_t from, size_t to) {
        return (performance[to][foot] - performance[from][foot]).norm();
      };
      out[t][side] = n > 1 && performance[t][foot].y() < lowest + kHigh &&
                     (t == 0 || moved(t - 1, t) < kStill) &&
                     (t + 1 == n || moved(t, t + 1) < kStill);
    }
  }
  return out;
}

namespace {

/// Two bones and what hangs on them: thigh, shin and foot, or upper arm, forearm and hand.
struct Chain {
  int from, middle, end;
  Vec3 bends;       ///< where the middle joint of a straight limb points, in the axes of `from`
  double straight;  ///< how much that counts
  /// The middle joint stays where it is as far as it can (a leg that moves little), or goes round
  /// with the limb's line (an arm, which may move far: it would flip).
  bool goes_round;
};

/// Moves the end of the chain by `offset` as far as it reaches; the end keeps its orientation, the
/// middle joint its side.
void move_end(const Joints& rest, const Chain& chain, const Vec3& offset, Pose* pose) {
  const auto from = static_cast<size_t>(chain.from), middle = static_cast<size_t>(chain.middle),
             end = static_cast<size_t>(chain.end);
  const PosedSkeleton posed = forward_kinematics(rest, *pose);
  const Vec3 h = posed.joints[from], k = posed.joints[middle], a = posed.joints[end];
  const double upper = (k - h).norm(), lower = (a - k).norm();
  const Vec3 wanted = a + offset - h;
  if (!(upper > 1e-6 && lower > 1e-6 && wanted.norm() > 1e-6)) return;
  const double reach =
      std::clamp(wanted.norm(), std::abs(upper - lower) + 1e-4, kStretched * (upper + lower));
  const Vec3 along = wanted.normalized();
  Vec3 bent = (k - h) + chain.straight * upper * (posed.global[from] * chain.bends);
  if (chain.goes_round) {
    const Vec3 before = (a - h).normalized();
    bent = shortest_arc(before, along) * (bent - before.dot(bent) * before);
  }
  Vec3 across = bent - along.dot(bent) * along;
  if (!(across.norm() > 1e-9)) return;
  across.normalize();
  const double cosine =
      std::clamp((upper * upper + reach * reach - lower * lower) / (2 * upper * reach), -1.0, 1.0);
  const Vec3 new_middle = upper * (cosine * along + std::sqrt(1 - cosine * cosine) * across);
  const Vec3 new_end = reach * along;
  const Mat3 upper_turn = shortest_arc(k - h, new_middle) * posed.global[from],
             lower_turn = shortest_arc(a - k, new_end - new_middle) * posed.global[middle];
  pose->local[from] = posed.global[static_cast<size_t>(kParents[from])].transpose() * upper_turn;
  pose->local[middle] = upper_turn.transpose() * lower_turn;
  pose->local[end] = lower_turn.transpose() * posed.global[end];
}

}  // namespace

void move_foot(const Joints& rest, int side, const Vec3& offset, Pose* pose) {
  move_end(rest, {1 + side, 4 + side, 7 + side, Vec3::UnitZ(), 1e-3, false}, offset, pose);
}

void move_hand(const Joints& rest, int side, const Vec3& offset, Pose* pose) {
  move_end(rest,
           {kLeftShoulder + side, kLeftElbow + side, kLeftWrist + side, -Vec3::UnitZ(), 0.1, true},
           offset, pose);
}

void turn_elbow(const Joints& rest, int side, const Vec3& place, Pose* pose) {
  constexpr double kBent = 0.1;  // how far off the line an elbow is that turns fully, of the arm
  const auto shoulder = static_cast<size_t>(kLeftShoulder + side),
             elbow = static_cast<size_t>(kLeftElbow + side),
             wrist = static_cast<size_t>(kLeftWrist + side);
  const PosedSkeleton posed = forward_kinematics(rest, *pose);
  const Vec3 arm = posed.joints[wrist] - posed.joints[shoulder];
  if (!(arm.norm() > 1e-6)) return;
  const Vec3 line = arm.normalized();
  const auto across = [&](const Vec3& at) -> Vec3 {
    const Vec3 from = at - posed.joints[shoulder];
    return from - line.dot(from) * line;
  };
  const Vec3 now = across(posed.joints[elbow]), then = across(place);
  if (!(now.norm() > 1e-6 && then.norm() > 1e-6)) return;
  const double length = (posed.joints[elbow] - posed.joints[shoulder]).norm() +
                        (posed.joints[wrist] - posed.joints[elbow]).norm();
  const double share = std::min(1.0, now.norm() / (kBent * length));
  const double angle = std::atan2(line.dot(now.cross(then)), now.dot(then));
  const Mat3 turn = Eigen::AngleAxisd(share * angle, line).toRotationMatrix();
  const auto parent = static_cast<size_t>(kParents[shoulder]);
  pose->local[shoulder] = posed.global[parent].transpose() * turn * posed.global[shoulder];
  pose->local[wrist] = (turn * posed.global[elbow]).transpose() * posed.global[wrist];
}

}  // namespace restage
