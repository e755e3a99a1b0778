#include "nn/geometry/soles.h"

#include <algorithm>
#include <cmath>

#include "nn/geometry/contact.h"
#include "nn/geometry/skinning.h"

namespace restage {

std::vector<int32_t> outermost(const Points& points, const std::vector<int32_t>& some) {
  std::vector<int32_t> out;
  for (int code = 0; code < 27 && !some.empty(); ++code) {
    const Point way(static_cast<float>(code % 3 - 1), static_cast<float>(code / 3 % 3 - 1),
                    static_cast<float>(code / 9 - 1));
    if (way.isZero()) continue;
    out.push_back(*std::max_element(some.begin(), some.end(), [&](int32_t a, int32_t b) {
      return way.dot(points[static_cast<size_t>(a)]) < way.dot(points[static_cast<size_t>(b)]);
    }));
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

Soles::Soles(const Joints& rest) : rest_(rest) {
  for (size_t side = 0; side < 2; ++side) {
    const auto foot = static_cast<size_t>(kFeet[side]);
    Spot spot{rest[foot], {}};
    spot.place.y() = 0;
    spot.weights[foot] = 1;
    feet_[side].push_back(spot);
  }
}

Soles::Soles(const Mesh& mesh, const Joints& rest, const SkinWeights& weights) : Soles(rest) {
  for (size_t side = 0; side < 2; ++side) {
    std::vector<int32_t> foot;
    for (Eigen::Index v = 0; v < weights.rows(); ++v)
      if (weights(v, 7 + static_cast<int>(side)) + weights(v, kFeet[side]) > 0.5f)
        foot.push_back(static_cast<int32_t>(v));
    if (foot.empty()) continue;
    feet_[side].clear();
    for (const int32_t v : outermost(mesh.vertices, foot)) {
      Spot spot{mesh.vertices[static_cast<size_t>(v)].cast<double>(), {}};
      std::copy_n(weights.row(v).data(), kJoints, spot.weights.begin());
      feet_[side].push_back(spot);
    }
  }
}

std::array<double, 2> Soles::lowest(const PosedSkeleton& posed) const {
  std::array<double, 2> out;
  for (size_t side = 0; side < 2; ++side) {
    const auto height = [&](const Spot& spot) {
      return blend(spot.place, spot.weights.data(), rest_, posed).y();
    };
    out[side] = height(feet_[side].front());
    for (const Spot& spot : feet_[side]) out[side] = std::min(out[side], height(spot));
  }
  return out;
}

std::array<double, 2> depths(const std::array<double, 2>& floor, const Soles& soles,
                             const Joints& rest, const Pose& pose) {
  const std::array<double, 2> lowest = soles.lowest(forward_kinematics(rest, pose));
  return {std::max(0.0, floor[0] - lowest[0]), std::max(0.0, floor[1] - lowest[1])};
}

namespace {

/// A leg from hip to ankle, and the length of its bones.
struct Leg {
  Vec3 line;
  double length;
};

Leg leg_of(const Joints& rest, int side, const Pose& pose) {
  const Joints joints = forward_kinematics(rest, pose).joints;
  const auto of = [&](int j) { return joints[static_cast<size_t>(j + side)]; };
  return {of(7) - of(1), (of(4) - of(1)).norm() + (of(7) - of(4)).norm()};
}

}  // namespace

double most_lift(const Joints& rest, int side, const Pose& pose) {
  constexpr double kFolded = 0.45;  // hip to ankle, of the leg
  const Leg leg = leg_of(rest, side, pose);
  const double least = kFolded * leg.length, beside = std::hypot(leg.line.x(), leg.line.z());
  if (beside >= least) return std::max(0.0, -leg.line.y());
  return std::max(0.0, -leg.line.y() - std::sqrt(least * least - beside * beside));
}

double most_drop(const Joints& rest, int side, const Pose& pose) {
  constexpr double kStraight = 0.985;  // hip to ankle, of the leg: the knee is bent by 20 degrees
  const Leg leg = leg_of(rest, side, pose);
  const double most = kStraight * leg.length, beside = std::hypot(leg.line.x(), leg.line.z());
  if (beside >= most) return 0;
  return std::max(0.0, leg.line.y() + std::sqrt(most * most - beside * beside));
}

void raise_feet(const std::array<double, 2>& by, const Joints& rest, Pose* pose) {
  for (int side = 0; side < 2; ++side) {
    const double wanted = by[static_cast<size_t>(side)];
    const double lift = wanted > 0   ? std::min(wanted, most_lift(rest, side, *pose))
                        : wanted < 0 ? std::max(wanted, -most_drop(rest, side, *pose))
                                     : 0;
    if (lift != 0) move_foot(rest, side, Vec3(0, lift, 0), pose);
  }
}

}  // namespace restage
