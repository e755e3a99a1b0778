#include "datasets/readers/point_path.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

namespace restage {
namespace {

constexpr size_t kFewestPlaces = 8;
constexpr size_t kLookedAt = 200;  // places whose nearest is sought
// Measured of 65 paths of roots and joints (CMU) and of 190 clouds of people, whole, thinned,
// sorted and in the rows of a depth camera: changes of 0.09 to 0.77 (and one of 0.91) and 1.3
// to 1.9, shares of 0.63 to 1 and 0 to 0.62.
constexpr double kMostChange = 0.8, kLeastShare = 0.55;

/// Without the places where the point stood still.
Points moving(const Points& points) {
  Points out;
  for (const Point& p : points)
    if (p.allFinite() && (out.empty() || p != out.back())) out.push_back(p);
  return out;
}

/// Whether the steps are short and differ little from those before.
bool moves_smoothly(const Points& at, double longest_step) {
  double lengths = 0, changes = 0;
  Eigen::AlignedBox3f box(at[0]);
  for (size_t i = 1; i < at.size(); ++i) {
    box.extend(at[i]);
    lengths += (at[i] - at[i - 1]).cast<double>().norm();
    if (i + 1 < at.size()) changes += (at[i + 1] - 2 * at[i] + at[i - 1]).cast<double>().norm();
  }
  const double step = lengths / static_cast<double>(at.size() - 1);
  return changes < kMostChange * lengths && step < longest_step * box.diagonal().norm();
}

/// How many places are nearest to one that is at most two steps away.
double share_near_in_order(const Points& at) {
  const size_t looked = std::min(at.size(), kLookedAt);
  size_t near = 0;
  for (size_t k = 0; k < looked; ++k) {
    const size_t i = k * at.size() / looked;
    size_t nearest = i;
    float least = std::numeric_limits<float>::infinity();
    for (size_t j = 0; j < at.size(); ++j) {
      const float distance = (at[j] - at[i]).squaredNorm();
      if (j == i || !(distance < least)) continue;
      least = distance;
      nearest = j;
    }
    near += (nearest > i ? nearest - i : i - nearest) <= 2;
  }
  return static_cast<double>(near) / static_cast<double>(looked);
}

}  // namespace

bool is_path(const Points& points, double longest_step) {
  const Points at = moving(points);
  return at.size() >= kFewestPlaces && moves_smoothly(at, longest_step) &&
         share_near_in_order(at) > kLeastShare;
}

}  // namespace restage
