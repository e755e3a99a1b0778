#include "datasets/sampling/skirt.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace restage {
namespace {

constexpr double kWaist = -0.25;  // where a skirt begins
constexpr size_t kRings = 24;

/// Both legs of somebody, and how far down a point is.
class Legs {
 public:
  Legs(const Joints& joints, double hem) : joints_(joints), hem_(hem) {
    const Vec3 top = middle(kWaist);
    down_ = (middle(hem) - top).normalized();
    for (size_t k = 0; k < kRings; ++k) {
      const double along = (middle(place(k)) - top).dot(down_);
      along_[k] = k == 0 ? along : std::max(along, along_[k - 1]);
    }
  }
  double place(size_t ring) const {
    return kWaist + (hem_ - kWaist) * static_cast<double>(ring) / (kRings - 1);
  }
  size_t ring(double s) const {
    const double at = (s - kWaist) / (hem_ - kWaist) * (kRings - 1);
    return static_cast<size_t>(std::clamp(std::lround(at), 0L, long{kRings - 1}));
  }
  /// The middle of a leg, 0 the left one.
  Vec3 at(size_t leg, double s) const {
    const size_t part = s < 1 ? 0 : 1;
    const Vec3 &from = joints_[1 + leg + 3 * part], &to = joints_[4 + leg + 3 * part];
    return from + (s - static_cast<double>(part)) * (to - from);
  }
  Vec3 middle(double s) const { return 0.5 * (at(0, s) + at(1, s)); }
  const Vec3& down() const { return down_; }
  /// Where along the legs a point is; NaN above the waist and below the hem.
  double place_of(const Vec3& p) const {
    const double t = (p - middle(kWaist)).dot(down_);
    if (t < along_.front() || t > along_.back()) return std::numeric_limits<double>::quiet_NaN();
    const auto next = static_cast<size_t>(
        std::upper_bound(along_.begin() + 1, along_.end() - 1, t) - along_.begin());
    const double step = along_[next] - along_[next - 1];
    const double share = step > 1e-9 ? (t - along_[next - 1]) / step : 0;
    return place(next - 1) + share * (place(next) - place(next - 1));
  }
  /// From the line between both legs.
  double distance(const Vec3& p, double s) const {
    const Vec3 a = at(0, s), across = at(1, s) - a;
    const double share = across.squaredNorm() > 1e-9
                             ? std::clamp((p - a).dot(across) / across.squaredNorm(), 0.0, 1.0)
                             : 0;
    return (p - a - share * across).norm();
  }

 private:
  const Joints& joints_;
  double hem_;
  Vec3 down_;
  std::array<double, kRings> along_;
};

/// Where a ring of cloth is, and which way is out: two straights with a half circle at each end.
/// Shares of its length begin outside the left leg; 0.5 is outside the right one.
struct OnRing {
  Vec3 point, out;
};
OnRing on_ring(const Legs& legs, double s, double radius, double share) {
  const Vec3 a = legs.at(0, s), b = legs.at(1, s);
  Vec3 across = b - a - (b - a).dot(legs.down()) * legs.down();
  const double wide = across.norm();
  if (wide < 1e-6) across = legs.down().unitOrthogonal();
  across.normalize();
  const Vec3 front = legs.down().cross(across);
  const double all = 2 * wide + 2 * std::numbers::pi * radius;
  double at = std::fmod(share * all + all - 0.5 * std::numbers::pi * radius, all);
  for (const double side : {1.0, -1.0}) {
    const Vec3 &from = side > 0 ? a : b, &to = side > 0 ? b : a;
    if (at < wide) return {from + at / wide * (to - from) + side * radius * front, side * front};
    at -= wide;
    if (at < std::numbers::pi * radius || side < 0) {
      const double angle = at / radius;
      const Vec3 out = side * (std::sin(angle) * across + std::cos(angle) * front);
      return {to + radius * out, out};
    }
    at -= std::numbers::pi * radius;
  }
  return {a, front};  // not reached
}

}  // namespace

Skirt draw_skirt(Rng& rng) {
  Skirt out;
  out.hem = rng.uniform(0.5, 1.8);
  out.ease = rng.uniform(0.005, 0.03);
  out.flare = rng.uniform(0, 0.15);
  out.folds = rng.uniform() < 0.5 ? rng.uniform(0.005, 0.03) : 0;
  out.fold_count = 5 + static_cast<int>(rng.below(12));
  out.phase = rng.uniform(0, 2 * std::numbers::pi);
  return out;
}

void put_on(const Skirt& skirt, const Joints& joints, const std::vector<bool>& legs, Rng& rng,
            Points& points, Points& normals) {
  constexpr double kWidest = 0.35;  // a knee that is pulled up is not gone round
  const Legs both(joints, skirt.hem);
  if (both.down().squaredNorm() < 0.5) return;  // both legs are one point
  std::array<double, kRings> radius{};
  struct Hidden {
    size_t point;
    double place;
  };
  std::vector<Hidden> hidden;
  for (size_t i = 0; i < points.size(); ++i) {
    if (!legs[i]) continue;
    const Vec3 p = points[i].cast<double>();
    const double s = both.place_of(p);
    if (std::isnan(s)) continue;
    hidden.push_back({i, s});
    double& widest = radius[both.ring(s)];
    widest = std::max(widest, std::min(kWidest, both.distance(p, s)));
  }
  for (size_t k = 1; k < kRings; ++k) radius[k] = std::max(radius[k], radius[k - 1]);
  for (const auto& [i, s] : hidden) {
    const Vec3 p = points[i].cast<double>();
    const bool left = (p - both.at(0, s)).norm() < (p - both.at(1, s)).norm();
    const double share = std::fmod((left ? 1.0 : 0.5) + rng.uniform(-0.25, 0.25), 1.0);
    const double fallen = (s - kWaist) / (skirt.hem - kWaist);
    const double fold = skirt.folds * fallen *
                        std::sin(2 * std::numbers::pi * skirt.fold_count * share + skirt.phase);
    const double wide =
        std::max(0.05, radius[both.ring(s)] + skirt.ease + skirt.flare * (s - kWaist) + fold);
    const OnRing cloth = on_ring(both, s, wide, share);
    points[i] = cloth.point.cast<float>();
    if (i < normals.size()) normals[i] = cloth.out.cast<float>();
  }
}

}  // namespace restage
