#include "datasets/sampling/scanner.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "autograd/base/error.h"
#include "nn/geometry/box.h"

namespace restage {
namespace {

constexpr double kNear = 0.05;  // metres: nothing closer is seen
constexpr int kMostPixels = 4096;

/// What one camera sees: depth along its axis (0: nothing) and the face at each pixel.
struct DepthMap {
  int width, height;
  std::vector<double> depth;
  std::vector<int32_t> face;
  size_t index(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
  }
  double at(int x, int y) const {
    return x < 0 || y < 0 || x >= width || y >= height ? 0.0 : depth[index(x, y)];
  }
};

class ScanView {
 public:
  explicit ScanView(const DepthCamera& c) : camera_(c) {
    const Vec3 ahead = c.target - c.eye;
    const Vec3 up = std::abs(ahead.normalized().y()) > 0.999 ? Vec3(0, 0, 1) : Vec3(0, 1, 0);
    const bool good = c.width > 0 && c.height > 0 && c.width <= kMostPixels &&
                      c.height <= kMostPixels && c.view > 0 && c.view < 3 && ahead.norm() > 1e-6;
    if (!good)
      throw InputError("", "a depth camera has no pixels or looks nowhere",
                       "give it a size, a target and an opening angle below 3 radians");
    const Vec3 back = -ahead.normalized(), right = up.cross(back).normalized();
    axes_.row(0) = right;
    axes_.row(1) = back.cross(right);
    axes_.row(2) = -back;  // depth grows ahead
    focus_ = 0.5 * c.height / std::tan(0.5 * c.view);
  }

  /// x and y in pixels from the upper left, z metres ahead.
  Vec3 project(const Point& p) const {
    const Vec3 q = axes_ * (p.cast<double>() - camera_.eye);
    return {0.5 * camera_.width + focus_ * q.x() / q.z(),
            0.5 * camera_.height - focus_ * q.y() / q.z(), q.z()};
  }
  /// Direction of a pixel's ray in the world, of length 1 along the camera's axis.
  Vec3 ray(int x, int y) const {
    return axes_.transpose() * Vec3((x + 0.5 - 0.5 * camera_.width) / focus_,
                                    -(y + 0.5 - 0.5 * camera_.height) / focus_, 1.0);
  }
  const DepthCamera& camera() const { return camera_; }

 private:
  const DepthCamera& camera_;
  Mat3 axes_;
  double focus_ = 1;
};

void fill_triangle(const Vec3& a, const Vec3& b, const Vec3& c, int32_t face, DepthMap& map) {
  if (!(std::min({a.z(), b.z(), c.z()}) > kNear)) return;
  const double area = (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
  if (!(std::abs(area) > 1e-12)) return;
  const auto range = [](double low, double high, int size) {
    const auto clamped = [&](double v) {
      return static_cast<int>(std::clamp(v, -1.0, static_cast<double>(size)));
    };
    return std::pair{std::max(0, clamped(std::floor(low - 0.5))),
                     std::min(size - 1, clamped(std::ceil(high - 0.5)))};
  };
  const auto [x0, x1] =
      range(std::min({a.x(), b.x(), c.x()}), std::max({a.x(), b.x(), c.x()}), map.width);
  const auto [y0, y1] =
      range(std::min({a.y(), b.y(), c.y()}), std::max({a.y(), b.y(), c.y()}), map.height);
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) {
      const double px = x + 0.5, py = y + 0.5;
      const double u = ((b.x() - px) * (c.y() - py) - (b.y() - py) * (c.x() - px)) / area;
      const double v = ((c.x() - px) * (a.y() - py) - (c.y() - py) * (a.x() - px)) / area;
      const double w = 1 - u - v;
      if (u < 0 || v < 0 || w < 0) continue;
      const double z = 1 / (u / a.z() + v / b.z() + w / c.z());  // linear in 1 / z
      const size_t i = map.index(x, y);
      if (map.face[i] >= 0 && map.depth[i] <= z) continue;
      map.depth[i] = z;
      map.face[i] = face;
    }
}

DepthMap depth_map(const Mesh& surface, const ScanView& view) {
  const int width = view.camera().width, height = view.camera().height;
  DepthMap map{width, height, {}, {}};
  map.depth.assign(static_cast<size_t>(width) * static_cast<size_t>(height), 0.0);
  map.face.assign(map.depth.size(), -1);
  std::vector<Vec3> seen;
  seen.reserve(surface.vertices.size());
  for (const Point& p : surface.vertices) seen.push_back(view.project(p));
  for (size_t f = 0; f < surface.faces.size(); ++f) {
    const Triangle& t = surface.faces[f];
    fill_triangle(seen.at(t[0]), seen.at(t[1]), seen.at(t[2]), static_cast<int32_t>(f), map);
  }
  return map;
}

/// Cosine between a face's normal, either side, and the ray.
double facing(const Mesh& surface, int32_t face, const Vec3& ray) {
  const Triangle& t = surface.faces[face];
  const auto at = [&](size_t k) { return Vec3(surface.vertices[t[k]].cast<double>()); };
  const Vec3 normal = (at(1) - at(0)).cross(at(2) - at(0));
  const double length = normal.norm() * ray.norm();
  return length > 0 ? std::abs(normal.dot(ray)) / length : 0.0;
}

/// Depth of the neighbour across an outline, 0 where (x, y) is on none.
double across_outline(const DepthMap& map, int x, int y, const ScannerNoise& noise) {
  constexpr int kStep[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
  const double here = map.at(x, y);
  for (const auto& step : kStep) {
    const double there = map.at(x + step[0], y + step[1]);
    if (there == 0.0) return here + noise.behind;
    if (std::abs(there - here) > noise.edge) return there;
  }
  return 0.0;
}

void measure(const Mesh& surface, const ScanView& view, const ScannerNoise& noise,
             const RngKey& key, Points& out) {
  const DepthMap map = depth_map(surface, view);
  for (int y = 0; y < map.height; ++y)
    for (int x = 0; x < map.width; ++x) {
      const size_t i = map.index(x, y);
      if (map.face[i] < 0) continue;
      Rng rng(key.fold(i));
      const Vec3 ray = view.ray(x, y);
      const double cosine = facing(surface, map.face[i], ray);
      const double answer =
          (1 - noise.dropout) * (noise.grazing > 0 ? std::min(1.0, cosine / noise.grazing) : 1.0);
      double depth = map.depth[i];
      if (rng.uniform() >= answer) continue;
      const double other = across_outline(map, x, y, noise);
      if (other > 0 && rng.uniform() < noise.mixed) depth += rng.uniform() * (other - depth);
      const double distance = depth * ray.norm();
      const double error = (noise.base + noise.growth * distance * distance) * rng.normal();
      out.push_back((view.camera().eye + ray * (depth * (1 + error / distance))).cast<float>());
    }
}

/// Stray points about the box of the cloud.
void add_outliers(double share, const RngKey& key, Points& cloud) {
  if (cloud.empty() || !(share > 0)) return;
  const Point low = box_of(cloud).min(), high = box_of(cloud).max();
  const Point margin = Point::Constant(0.3f);
  Rng rng(key);
  const auto count = static_cast<size_t>(share * static_cast<double>(cloud.size()) + rng.uniform());
  for (size_t i = 0; i < count; ++i) {
    Point at;
    for (int c = 0; c < 3; ++c) at[c] = static_cast<float>(rng.uniform());
    cloud.push_back(low - margin + at.cwiseProduct(high - low + 2 * margin));
  }
}

}  // namespace

Points scan_surface(const Mesh& surface, const std::vector<DepthCamera>& cameras,
                    const ScannerNoise& noise, const RngKey& key) {
  Points out;
  for (size_t c = 0; c < cameras.size(); ++c)
    measure(surface, ScanView(cameras[c]), noise, key.fold("camera").fold(c), out);
  add_outliers(noise.outliers, key.fold("outliers"), out);
  return out;
}

std::vector<DepthCamera> camera_ring(int count, double radius, double azimuth, const Vec3& centre,
                                     const std::vector<double>& heights, const DepthCamera& model) {
  std::vector<DepthCamera> out;
  for (int i = 0; i < count; ++i) {
    const double angle = azimuth + 2 * std::numbers::pi * i / count;
    DepthCamera camera = model;
    camera.target = centre;
    camera.eye = centre + radius * Vec3(std::sin(angle), 0, std::cos(angle));
    camera.eye.y() = heights.at(static_cast<size_t>(i) % heights.size());
    out.push_back(camera);
  }
  return out;
}

}  // namespace restage
