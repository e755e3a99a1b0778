#include "datasets/readers/clouds/point_path.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

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

/// The means of at most 24 runs of places, of each axis.
std::vector<Point> run_means(const Points& at) {
  constexpr size_t kRuns = 24;
  const size_t runs = std::min(at.size(), kRuns);
  std::vector<Point> out(runs, Point::Zero());
  for (size_t r = 0; r < runs; ++r) {
    const size_t begin = r * at.size() / runs, end = (r + 1) * at.size() / runs;
    for (size_t i = begin; i < end; ++i) out[r] += at[i] / static_cast<float>(end - begin);
  }
  return out;
}

/// How often the places go from one side of an axis to the other, through half of their extent.
size_t crossings(const Points& at, int axis, float low, float high) {
  const float quarter = 0.25f * (high - low);
  int side = 0;
  size_t out = 0;
  for (const Point& p : at) {
    const int now = p[axis] < low + quarter ? -1 : p[axis] > high - quarter ? 1 : 0;
    if (now == 0) continue;
    out += side != 0 && now != side;
    side = now;
  }
  return out;
}

/// Whether the points are rings or arcs around a body, one above the other, as a lidar of few beams
/// sees it: along one axis they go on and on, while they cross the body again and again, and travel
/// much farther than the body is long. Nobody moves so.
bool are_rings(const Points& at) {
  constexpr float kLeastLength = 0.4f;  // along the axis, times the width of the rings
  constexpr float kMostReturns = 1.5f;  // travel along the axis, times the length
  constexpr double kLeastTravel = 2.0;  // in all, times the length
  constexpr size_t kLeastCrossings = 3;
  Eigen::AlignedBox3f box;
  double travel = 0;
  for (size_t i = 0; i < at.size(); ++i) {
    box.extend(at[i]);
    if (i > 0) travel += (at[i] - at[i - 1]).cast<double>().norm();
  }
  const std::vector<Point> means = run_means(at);
  for (int axis = 0; axis < 3; ++axis) {
    int across = (axis + 1) % 3;
    if (box.sizes()[(axis + 2) % 3] > box.sizes()[across]) across = (axis + 2) % 3;
    const float length = box.sizes()[axis];
    float along = 0;
    for (size_t r = 1; r < means.size(); ++r)
      along += std::abs(means[r][axis] - means[r - 1][axis]);
    if (length >= kLeastLength * box.sizes()[across] && along <= kMostReturns * length &&
        travel >= kLeastTravel * length &&
        crossings(at, across, box.min()[across], box.max()[across]) >= kLeastCrossings)
      return true;
  }
  return false;
}

}  // namespace

bool is_path(const Points& points, double longest_step) {
  const Points at = moving(points);
  return at.size() >= kFewestPlaces && moves_smoothly(at, longest_step) && !are_rings(at) &&
         share_near_in_order(at) > kLeastShare;
}

}  // namespace restage
