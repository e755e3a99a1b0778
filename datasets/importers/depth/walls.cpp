#include "datasets/importers/depth/walls.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "autograd/base/rng.h"
#include "datasets/doctor/shape.h"

namespace restage {
namespace {

constexpr size_t kMostWalls = 6, kWallPoints = 3000, kFewestOnWall = 60;
constexpr int kWallTries = 400;
constexpr double kWallBase = 0.015, kWallGrowth = 0.006;  // metres, and a metre of distance squared
constexpr double kWallShare = 0.03;                       // of the points
constexpr double kWallBehind = 0.05;    // of the points that may lie behind the last wall there is
constexpr double kThroughDoors = 0.15;  // that may lie behind any wall
constexpr double kWallCell = 0.2;       // metres
constexpr size_t kWallInside = 20;  // cells that have others all around: a person has some seven
constexpr int kInsideNeighbours = 7;
constexpr double kLeastNoise = 0.15, kMostNoise = 1.2;  // times what is usual

/// How far off a wall its points may be, by the distance from the camera.
double usual_error(const Point& p) {
  return kWallBase + kWallGrowth * static_cast<double>(p.z()) * static_cast<double>(p.z());
}

bool is_on(const Wall& wall, const Point& p) {
  return std::abs(wall.above(p)) <= wall.noise * usual_error(p);
}

/// Turned to the camera.
Wall through(const Vec3& at, Vec3 normal) {
  if (normal.dot(at) > 0) normal = -normal;
  Wall out;
  out.plane = {normal, normal.dot(at)};
  return out;
}

/// Of three points, which lie near each other in every second try: in the pictures' order.
std::optional<Wall> any_wall(const Points& points, int round, Rng& rng) {
  const size_t n = points.size(), reach = std::max<size_t>(3, n / 8);
  const size_t first = rng.below(n);
  const auto other = [&] {
    const size_t k = round % 2 == 0 ? rng.below(n) : (first + n - reach / 2 + rng.below(reach)) % n;
    return Vec3(points[k].cast<double>());
  };
  const Vec3 a = points[first].cast<double>(), b = other(), c = other();
  const Vec3 normal = (b - a).cross(c - a);
  const double area = normal.norm();
  if (!(area > 0.01) || !std::isfinite(area)) return std::nullopt;
  return through(a, normal / area);
}

/// By least squares, nearer points counting more.
Wall fitted_wall(const Points& points, const Wall& wall) {
  Vec3 middle = Vec3::Zero();
  Mat3 spread = Mat3::Zero();
  double sum = 0;
  const auto weight = [](const Point& p) { return 1 / (usual_error(p) * usual_error(p)); };
  for (const Point& p : points)
    if (is_on(wall, p)) middle += weight(p) * p.cast<double>(), sum += weight(p);
  if (!(sum > 0)) return wall;
  middle /= sum;
  for (const Point& p : points)
    if (is_on(wall, p)) {
      const Vec3 r = p.cast<double>() - middle;
      spread += weight(p) * r * r.transpose();
    }
  return through(middle, Eigen::SelfAdjointEigenSolver<Mat3>(spread).eigenvectors().col(0));
}

/// How many of the points lie behind it.
size_t behind(const Points& points, const Wall& wall) {
  return static_cast<size_t>(std::count_if(points.begin(), points.end(), [&](const Point& p) {
    return wall.above(p) < -wall.noise * usual_error(p);
  }));
}

/// Of the points that are left, with few of all of them behind it (doors and windows): no slab
/// through people and things before a wall.
std::optional<Wall> largest_wall(const Points& points, const Points& all, Rng& rng) {
  const double most_behind = kThroughDoors * static_cast<double>(all.size());
  std::optional<Wall> best;
  for (int round = 0; round < kWallTries; ++round) {
    std::optional<Wall> wall = any_wall(points, round, rng);
    if (!wall) continue;
    for (const Point& p : points) wall->points += is_on(*wall, p);
    const bool larger = !best || wall->points > best->points;
    if (larger && static_cast<double>(behind(all, *wall)) < most_behind) best = wall;
  }
  if (!best) return best;
  return fitted_wall(points, fitted_wall(points, *best));
}

/// Of a person's front, which is rather flat, hardly any cell is inside.
bool is_large(const Points& points, const Wall& wall) {
  const Vec3 right = wall.plane.normal.unitOrthogonal(), ahead = wall.plane.normal.cross(right);
  std::set<std::pair<long, long>> cells;
  for (const Point& p : points)
    if (is_on(wall, p))
      cells.emplace(std::lround(right.dot(p.cast<double>()) / kWallCell),
                    std::lround(ahead.dot(p.cast<double>()) / kWallCell));
  size_t inside = 0;
  for (const auto& [x, y] : cells) {
    int neighbours = 0;
    for (int k = 0; k < 9; ++k)
      neighbours += k != 4 && cells.contains({x + k / 3 - 1, y + k % 3 - 1});
    inside += neighbours >= kInsideNeighbours;
  }
  return inside >= kWallInside;
}

}  // namespace

bool Wall::has(const Point& p) const {
  const double height = above(p), error = noise * usual_error(p);
  return height <= error && (is_last || height >= -error);
}

std::vector<Wall> find_walls(const Points& points) {
  std::vector<Wall> out;
  Points some, left;
  const size_t n = std::min(points.size(), kWallPoints);
  for (size_t i = 0; i < n; ++i) some.push_back(points[i * points.size() / n]);
  left = some;
  Rng rng(RngKey{0, 0}.fold("walls"));
  while (out.size() < kMostWalls && left.size() > kFewestOnWall) {
    std::optional<Wall> wall = largest_wall(left, some, rng);
    if (!wall) break;
    std::vector<double> errors;
    for (const Point& p : left)
      if (is_on(*wall, p)) errors.push_back(std::abs(wall->above(p)) / usual_error(p));
    wall->points = errors.size();
    if (wall->points < kFewestOnWall ||
        static_cast<double>(wall->points) < kWallShare * static_cast<double>(n) ||
        !is_large(left, *wall))
      break;
    wall->noise = std::clamp(5 * median(std::move(errors)), kLeastNoise, kMostNoise);
    wall->plane = fitted_wall(left, *wall).plane;
    wall->is_last = static_cast<double>(behind(some, *wall)) < kWallBehind * static_cast<double>(n);
    std::erase_if(left, [&](const Point& p) { return wall->has(p); });
    out.push_back(*wall);
  }
  return out;
}

}  // namespace restage
