#include "datasets/sampling/sensors.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "nn/geometry/box.h"

namespace restage {
namespace {

constexpr float kCell = 0.035f;       // of the grid across a camera's view, metres
constexpr float kBehind = 0.05f;      // points up to here behind the nearest of their cell are seen
constexpr float kBehindNear = 0.12f;  // and up to here behind that of a cell beside it: no gaps
constexpr float kGrazing = 0.1f;      // cosine below which a surface gives no answer
constexpr size_t kLeast = 64;

struct Camera {
  Point towards, across, up;  ///< from the person to the camera, and the axes of its picture
};

Camera camera_at(double azimuth, double height) {
  const auto c = static_cast<float>(std::cos(height)), s = static_cast<float>(std::sin(height));
  const auto x = static_cast<float>(std::sin(azimuth)), z = static_cast<float>(std::cos(azimuth));
  Camera out;
  out.towards = Point(c * x, s, c * z);
  out.across = Point(z, 0, -x);
  out.up = out.towards.cross(out.across);
  return out;
}

std::vector<Camera> draw_cameras(const Watch& watch, Rng& rng) {
  constexpr double kPi = std::numbers::pi;
  std::vector<Camera> out;
  const double least = watch.ceiling ? 40 : -15, most = watch.ceiling ? 90 : 40;
  const auto height = [&] { return rng.uniform(least, most) * kPi / 180; };
  const double start = rng.uniform(0, 2 * kPi);
  const auto count = watch.sensor == Sensor::one_camera ? size_t{1} : 3 + rng.below(5);
  for (size_t k = 0; k < count; ++k)
    out.push_back(camera_at(start + 2 * kPi * (static_cast<double>(k) + 0.3 * rng.uniform(-1, 1)) /
                                        static_cast<double>(count),
                            height()));
  return out;
}

/// The nearest depths of a camera's picture, cell by cell.
class SensorDepth {
 public:
  explicit SensorDepth(const Points& view) : low_(box_of(view).min()) {
    const Point size = box_of(view).sizes();
    width_ = std::max(kCell, std::max(size.x(), size.y()) / 1000);  // of giants' cells
    columns_ = static_cast<int>(size.x() / width_) + 3;             // with an empty margin
    rows_ = static_cast<int>(size.y() / width_) + 3;
    nearest_.assign(static_cast<size_t>(columns_ * rows_), std::numeric_limits<float>::lowest());
    for (const Point& p : view) nearest_[cell(p)] = std::max(nearest_[cell(p)], p.z());
  }
  bool hides(const Point& p) const {
    const size_t own = cell(p);
    if (p.z() < nearest_[own] - kBehind) return true;
    for (const int row : {-1, 0, 1})
      for (const int column : {-1, 0, 1})
        if (p.z() < nearest_[own + static_cast<size_t>(row * columns_ + column)] - kBehindNear)
          return true;
    return false;
  }

 private:
  size_t cell(const Point& p) const {
    return static_cast<size_t>(static_cast<int>((p.y() - low_.y()) / width_ + 1) * columns_ +
                               static_cast<int>((p.x() - low_.x()) / width_ + 1));
  }
  Point low_;
  float width_ = kCell;
  int columns_ = 0, rows_ = 0;
  std::vector<float> nearest_;
};

/// Adds to `seen` the cosine at which the camera sees each point, if it does.
void look(const Camera& camera, const Points& points, const Points& normals,
          std::vector<float>* seen) {
  Points view;
  for (const Point& p : points)
    view.emplace_back(camera.across.dot(p), camera.up.dot(p), camera.towards.dot(p));
  const SensorDepth map(view);
  for (size_t i = 0; i < points.size(); ++i) {
    const float cosine = camera.towards.dot(normals[i]);
    if (cosine > kGrazing && !map.hides(view[i])) (*seen)[i] += cosine;
  }
}

/// Takes a ball out of the cloud, or what lies near the floor.
void lose_part(const Points& points, Rng& rng, std::vector<float>* seen) {
  std::vector<float> kept = *seen;
  if (rng.uniform() < 0.2) {
    const Point& centre = points[rng.below(points.size())];
    const auto radius = static_cast<float>(rng.uniform(0.08, 0.25));
    for (size_t i = 0; i < points.size(); ++i)
      if ((points[i] - centre).norm() < radius) kept[i] = 0;
  }
  if (rng.uniform() < 0.1) {
    const float floor = box_of(points).min().y() + static_cast<float>(rng.uniform(0.02, 0.2));
    for (size_t i = 0; i < points.size(); ++i)
      if (points[i].y() < floor) kept[i] = 0;
  }
  const auto left =
      static_cast<size_t>(std::count_if(kept.begin(), kept.end(), [](float w) { return w > 0; }));
  if (left >= 2 * kLeast) *seen = kept;
}

/// Numbers of at most `n` points, drawn without repeats in proportion to their weights.
std::vector<size_t> draw(const std::vector<float>& weights, size_t n, Rng& rng) {
  std::vector<std::pair<double, size_t>> order;
  for (size_t i = 0; i < weights.size(); ++i)
    if (weights[i] > 0)
      order.emplace_back(-std::log(1 - rng.uniform()) / static_cast<double>(weights[i]), i);
  std::sort(order.begin(), order.end());
  std::vector<size_t> out;
  for (size_t k = 0; k < std::min(n, order.size()); ++k) out.push_back(order[k].second);
  return out;
}

}  // namespace

size_t candidates(Sensor sensor, size_t n) {
  return sensor == Sensor::none ? n : sensor == Sensor::one_camera ? 7 * n / 2 : 2 * n;
}

Points sensed(const Watch& watch, const Points& points, const Points& normals, size_t n,
              const RngKey& camera_key, const RngKey& key, std::vector<size_t>* which) {
  Rng rng(key), camera_rng(camera_key);
  const bool none = watch.sensor == Sensor::none;
  std::vector<float> seen(points.size(), none ? 1.0f : 0.0f);
  const std::vector<Camera> cameras =
      none ? std::vector<Camera>{} : draw_cameras(watch, camera_rng);
  for (const Camera& camera : cameras) look(camera, points, normals, &seen);
  if (!cameras.empty()) lose_part(points, rng, &seen);
  *which = draw(seen, n, rng);
  Points out;
  for (const size_t i : *which) out.push_back(points[i]);
  if (cameras.empty()) return out;
  const double along = camera_rng.uniform(0, 0.008), mixed = camera_rng.uniform(0, 0.03),
               outliers = camera_rng.uniform(0, 0.01);
  const Box box = box_of(out);
  for (Point& p : out) {
    const Camera& camera = cameras[rng.below(cameras.size())];
    double depth = along * rng.normal();
    if (rng.uniform() < mixed) depth += rng.uniform(0, 0.25);
    p -= static_cast<float>(depth) * camera.towards;
    if (rng.uniform() >= outliers) continue;
    for (int axis = 0; axis < 3; ++axis)
      p[axis] = static_cast<float>(rng.uniform(static_cast<double>(box.min()[axis]) - 0.2,
                                               static_cast<double>(box.max()[axis]) + 0.2));
  }
  return out;
}

}  // namespace restage
