#include "datasets/doctor/planes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "autograd/base/rng.h"
#include "datasets/doctor/shape.h"

namespace restage {
namespace {

constexpr int kPlanes = 3, kTries = 600;
constexpr size_t kLooked = 2000;
constexpr size_t kLeast = 100;       // points; fewer show no plane
constexpr double kThick = 0.01;      // times the diagonal: on the plane, at first
constexpr double kThinnest = 0.001;  // no plane is thinner
constexpr double kShare = 0.08;      // of the points that a plane has at least
constexpr double kBehind = 0.05;     // of the points that may lie on its other side
constexpr double kRest = 0.02;       // of the points that are not on it: somebody
// Far beyond: cells inside what the plane fills beside the rest's shadow. A trunk fills some ten,
// arms and legs none, two square metres of floor about a person fill sixty.
constexpr double kReachCell = 0.04;  // times the diagonal
constexpr int kFilled = 40;
constexpr int kNeighbours = 6;  // of eight that a cell inside has

struct Plane {
  Vec3 normal = Vec3::UnitY();
  double offset = 0, thick = 0;
  double above(const Point& p) const { return normal.dot(p.cast<double>()) - offset; }
  bool has(const Point& p) const { return std::abs(above(p)) <= thick; }
};

/// Of the box about most of the points.
double diagonal(const Points& points) {
  Vec3 size;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<float> x;
    for (const Point& p : points) x.push_back(p[axis]);
    std::sort(x.begin(), x.end());
    size[axis] = static_cast<double>(x[x.size() - 1 - x.size() / 50]) - x[x.size() / 50];
  }
  return size.norm();
}

/// Through the points that are on it, by least squares.
Plane fitted(const Points& points, Plane plane) {
  Vec3 middle = Vec3::Zero();
  Mat3 spread = Mat3::Zero();
  double n = 0;
  for (const Point& p : points)
    if (plane.has(p)) middle += p.cast<double>(), ++n;
  middle /= n;
  for (const Point& p : points)
    if (plane.has(p)) {
      const Vec3 r = p.cast<double>() - middle;
      spread += r * r.transpose();
    }
  const Vec3 normal = Eigen::SelfAdjointEigenSolver<Mat3>(spread).eigenvectors().col(0);
  plane.normal = normal.dot(plane.normal) < 0 ? Vec3(-normal) : normal;
  plane.offset = plane.normal.dot(middle);
  return plane;
}

/// The plane with most points that has nearly all others above it (RANSAC, Fischler 1981).
std::optional<Plane> best_plane(const Points& points, double thick) {
  const auto n = static_cast<double>(points.size());
  Rng rng(RngKey{0, 0}.fold("planes"));
  Plane best;
  double most = kShare * n;
  bool found = false;
  for (int i = 0; i < kTries; ++i) {
    const auto any = [&] { return Vec3(points[rng.below(points.size())].cast<double>()); };
    const Vec3 a = any(), b = any(), c = any();
    Plane plane{(b - a).cross(c - a), 0, thick};
    const double area = plane.normal.norm();
    if (!(area > thick * thick) || !std::isfinite(area)) continue;
    plane.normal /= area;
    plane.offset = plane.normal.dot(a);
    double on = 0, above = 0;
    for (const Point& p : points) {
      const double height = plane.above(p);
      on += std::abs(height) <= thick;
      above += height > thick;
    }
    const double below = n - on - above;
    if (on <= most || std::min(above, below) > kBehind * n || on > (1 - kRest) * n) continue;
    if (below > above) plane.normal = -plane.normal, plane.offset = -plane.offset;
    best = plane;
    most = on;
    found = true;
  }
  if (!found) return std::nullopt;
  return fitted(points, best);
}

/// Whether the plane fills much room beside what stands on it.
bool reaches_far(const Points& points, const Plane& plane, double cell) {
  const Vec3 right = plane.normal.unitOrthogonal(), ahead = plane.normal.cross(right);
  const auto cell_of = [&](const Point& p) {
    const auto at = [&](const Vec3& axis) {
      return std::llround(std::clamp(axis.dot(p.cast<double>()) / cell, -1e9, 1e9));
    };
    return std::pair(at(right), at(ahead));
  };
  std::map<std::pair<long long, long long>, bool> shadow;  // filled by the plane: false
  for (const Point& p : points)
    if (!plane.has(p)) shadow[cell_of(p)] = true;
  for (const Point& p : points)
    if (plane.has(p)) shadow.try_emplace(cell_of(p), false);
  int filled = 0;
  for (const auto& [at, dark] : shadow) {
    int neighbours = 0, dark_ones = 0;
    for (int k = 0; k < 9; ++k) {
      const auto next = shadow.find({at.first + k / 3 - 1, at.second + k % 3 - 1});
      if (k == 4 || next == shadow.end()) continue;
      ++neighbours;
      dark_ones += next->second;
    }
    filled += !dark && dark_ones == 0 && neighbours >= kNeighbours;
  }
  return filled >= kFilled;
}

/// As thick as the noise of its points is.
double noise_of(const Points& points, const Plane& plane) {
  std::vector<double> away;
  for (const Point& p : points)
    if (plane.has(p)) away.push_back(std::abs(plane.above(p)));
  return 6 * median(std::move(away));  // four standard deviations
}

}  // namespace

Planes find_planes(const Points& points) {
  Planes out;
  out.on.assign(points.size(), false);
  Points left = points;
  for (int round = 0; round < kPlanes && left.size() >= kLeast; ++round) {
    Points some;
    const size_t n = std::min(left.size(), kLooked);
    for (size_t i = 0; i < n; ++i) some.push_back(left[i * left.size() / n]);
    const double size = diagonal(some);
    if (!(size > 0) || !std::isfinite(size * size)) break;
    std::optional<Plane> plane = best_plane(some, kThick * size);
    if (!plane || !reaches_far(left, *plane, kReachCell * size)) break;
    plane->thick = std::clamp(noise_of(some, *plane), kThinnest * size, kThick * size);
    plane = fitted(some, *plane);
    std::vector<bool> on = out.on;
    left.clear();
    for (size_t i = 0; i < points.size(); ++i) {
      on[i] = on[i] || plane->has(points[i]);
      if (!on[i]) left.push_back(points[i]);
    }
    // A sheet that is bent a little: nobody is beside it.
    if (static_cast<double>(left.size()) < kRest * static_cast<double>(points.size())) break;
    out.on = std::move(on);
    out.points = points.size() - left.size();
    out.planes.push_back({plane->normal, plane->offset});
  }
  return out;
}

}  // namespace restage
