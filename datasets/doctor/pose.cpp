#include "datasets/doctor/pose.h"

#include <algorithm>
#include <cmath>

#include "datasets/doctor/shape.h"

namespace restage {
namespace {

constexpr double kDegrees = 180 / 3.14159265358979323846;
// Shares of the height: shoulders and hips of a T-pose (data of 160 bodies).
constexpr double kShoulderHeight = 0.81, kShoulderWidth = 0.10, kShortestReach = 0.22;
constexpr double kHipHeight = 0.53, kHipWidth = 0.055, kFoot = 0.06;
constexpr double kChestHeight = 0.6, kNeckHeight = 0.8, kTrunkWidth = 0.12;

/// The middle of the points that `chosen` takes; nothing if there are none.
template <class Chosen>
std::optional<Vec3> middle_of(const std::vector<Vec3>& points, Chosen&& chosen) {
  Vec3 sum = Vec3::Zero();
  double n = 0;
  for (const Vec3& p : points)
    if (chosen(p)) sum += p, ++n;
  if (n == 0) return std::nullopt;
  return Vec3(sum / n);
}

/// On the floor, in units of the height, the trunk over the origin.
std::vector<Vec3> normed(const Points& points) {
  const double floor = quantile(points, Vec3::UnitY(), 0.002),
               height = quantile(points, Vec3::UnitY(), 0.998) - floor,
               middle = quantile(points, Vec3::UnitX(), 0.5);
  std::vector<Vec3> out;
  if (!(height > 0)) return out;
  std::vector<double> depth;
  for (const Point& p : points) {
    out.push_back((p.cast<double>() - Vec3(middle, floor, 0)) / height);
    const Vec3& x = out.back();
    if (x.y() > kChestHeight && x.y() < kNeckHeight && std::abs(x.x()) < kTrunkWidth)
      depth.push_back(x.z());
  }
  const double trunk = median(std::move(depth));
  for (Vec3& p : out) p.z() -= trunk;
  return out;
}

double angle(const Vec3& bone, const Vec3& wanted) {
  const double length = bone.norm();
  return length > 0 ? std::acos(std::clamp(bone.dot(wanted) / length, -1.0, 1.0)) * kDegrees : 180;
}

}  // namespace

TPoseAngles t_pose_angles(const Joints& joints) {
  TPoseAngles out;
  for (const int side : {0, 1}) {
    const double sign = side == 0 ? 1 : -1;
    const Vec3 arm = joints[20 + side] - joints[16 + side],
               leg = joints[7 + side] - joints[1 + side];
    out.arms[side] = angle(arm, sign * Vec3::UnitX());
    out.below[side] = std::atan2(-arm.y(), std::hypot(arm.x(), arm.z())) * kDegrees;
    out.turned -= sign * std::atan2(arm.z(), sign * arm.x()) * kDegrees / 2;
    out.legs = std::max(out.legs, angle(leg, -Vec3::UnitY()));
  }
  return out;
}

std::optional<TPoseAngles> t_pose_angles(const Points& points) {
  const std::vector<Vec3> normal = normed(points);
  if (normal.empty()) return std::nullopt;
  TPoseAngles out;
  for (const int side : {0, 1}) {
    const double sign = side == 0 ? 1 : -1;
    std::vector<double> outwards;
    for (const Vec3& p : normal) outwards.push_back(sign * p.x());
    const double reach = quantile(std::move(outwards), 0.985);
    const Vec3 hand = *middle_of(normal, [&](const Vec3& p) { return sign * p.x() >= reach; });
    if (sign * hand.x() < kShortestReach) return std::nullopt;
    const double level = std::hypot(hand.x(), hand.z());
    const double down = std::atan2(kShoulderHeight - hand.y(), level - kShoulderWidth),
                 aside = std::atan2(hand.z(), sign * hand.x());
    out.below[side] = down * kDegrees;
    out.arms[side] = std::acos(std::cos(down) * std::cos(aside)) * kDegrees;
    // Towards the left: the left hand goes back, the right one forwards.
    out.turned -= sign * aside * kDegrees / 2;
    const auto foot =
        middle_of(normal, [&](const Vec3& p) { return p.y() < kFoot && sign * p.x() >= 0; });
    if (!foot) continue;
    const Vec3 leg = *foot - Vec3(sign * kHipWidth, kHipHeight, 0);
    out.legs = std::max(out.legs, std::atan2(std::hypot(leg.x(), leg.z()), -leg.y()) * kDegrees);
  }
  return out;
}

}  // namespace restage
