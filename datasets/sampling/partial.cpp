#include "datasets/sampling/partial.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace restage {

Cut draw_cut(Rng& rng) {
  Cut out;
  if (rng.uniform() < 0.6) {
    out.share = rng.uniform() < 1.0 / 3 ? rng.uniform(0.45, 0.6) : rng.uniform(0.1, 0.6);
    return out;
  }
  Vec3 towards;
  for (int c = 0; c < 3; ++c) towards[c] = rng.normal();
  if (towards.norm() > 1e-9) out.towards = towards.normalized().cast<float>();
  out.share = rng.uniform(0.05, 0.4);
  return out;
}

void keep_beyond(const Point& towards, float edge, Points& points, std::vector<size_t>& which) {
  const auto stays = [&](const Point& p) { return towards.dot(p) >= edge; };
  if (std::count_if(points.begin(), points.end(), stays) < std::ptrdiff_t{kLeastPoints}) return;
  size_t kept = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    if (!stays(points[i])) continue;
    points[kept] = points[i];
    which[kept++] = which[i];
  }
  points.resize(kept);
  which.resize(kept);
}

void cut_away(const Cut& cut, Points& points, std::vector<size_t>& which) {
  float low = std::numeric_limits<float>::max(), high = std::numeric_limits<float>::lowest();
  for (const Point& p : points) {
    low = std::min(low, cut.towards.dot(p));
    high = std::max(high, cut.towards.dot(p));
  }
  keep_beyond(cut.towards, low + static_cast<float>(cut.share) * (high - low), points, which);
}

void thin_out(Rng& rng, size_t most, Points& points, std::vector<size_t>& which) {
  const double range = std::log(static_cast<double>(std::max(most, kLeastPoints)) / kLeastPoints);
  const auto n = static_cast<size_t>(kLeastPoints * std::exp(range * rng.uniform()));
  if (n >= points.size()) return;
  points.resize(n);
  which.resize(n);
}

Mat3 draw_tilt(Rng& rng) {
  constexpr double kUsual = 20 * M_PI / 180;
  const double along = rng.uniform(-M_PI, M_PI);
  const double angle = rng.uniform() < 0.75 ? kUsual * rng.normal() : rng.uniform(-M_PI, M_PI);
  return Mat3(Eigen::AngleAxisd(angle, Vec3(std::cos(along), 0, std::sin(along))));
}

}  // namespace restage
