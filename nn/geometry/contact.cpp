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

void move_foot(const Joints& rest, int side, const Vec3& offset, Pose* pose) {
  const int hip = 1 + side, knee = 4 + side, ankle = 7 + side;
  const PosedSkeleton posed = forward_kinematics(rest, *pose);
  const Vec3 h = posed.joints[hip], k = posed.joints[knee], a = posed.joints[ankle];
  const double thigh = (k - h).norm(), shin = (a - k).norm();
  const Vec3 wanted = a + offset - h;
  if (!(thigh > 1e-6 && shin > 1e-6 && wanted.norm() > 1e-6)) return;
  const double reach =
      std::clamp(wanted.norm(), std::abs(thigh - shin) + 1e-4, kStretched * (thigh + shin));
  const Vec3 along = wanted.normalized();
  // Where the knee points; of a straight leg, forward a little.
  const Vec3 bent = (k - h) + 1e-3 * thigh * posed.global[hip].col(2);
  Vec3 across = bent - along.dot(bent) * along;
  if (!(across.norm() > 1e-9)) return;
  across.normalize();
  const double cosine =
      std::clamp((thigh * thigh + reach * reach - shin * shin) / (2 * thigh * reach), -1.0, 1.0);
  const Vec3 new_knee = thigh * (cosine * along + std::sqrt(1 - cosine * cosine) * across);
  const Vec3 new_ankle = reach * along;
  const Mat3 thigh_turn = shortest_arc(k - h, new_knee) * posed.global[hip],
             shin_turn = shortest_arc(a - k, new_ankle - new_knee) * posed.global[knee];
  pose->local[hip] = posed.global[kParents[hip]].transpose() * thigh_turn;
  pose->local[knee] = thigh_turn.transpose() * shin_turn;
  pose->local[ankle] = shin_turn.transpose() * posed.global[ankle];
}

}  // namespace restage
