#include "datasets/doctor/shape.h"

#include <cmath>
#include <map>
#include <set>

#include "datasets/doctor/orientation_model.h"
#include "datasets/sampling/surface.h"

namespace restage {
namespace {

constexpr size_t kSurfacePoints = 2000;
// Logarithm of a person's size in metres: built-in bodies in all their poses have -0.92 +- 0.14,
// people from children to giants get more room.
constexpr double kMeanLogSize = -0.94, kDeviation = 0.22;
constexpr double kNoPerson = 0.0111;  // density of "no person, or another unit": 3 deviations

/// A mesh whose surface can be sampled.
bool has_area(const Mesh& mesh) {
  return std::any_of(mesh.faces.begin(), mesh.faces.end(), [&](const Triangle& f) {
    const auto at = [&](int k) { return mesh.vertices[f[k]]; };
    const float area = (at(1) - at(0)).cross(at(2) - at(0)).norm();
    return area > 0 && std::isfinite(area);
  });
}

}  // namespace

std::vector<size_t> first_equals(const Points& points) {
  struct Entry {
    std::array<float, 3> point;
    size_t index;
    bool operator<(const Entry& other) const {
      return point != other.point ? point < other.point : index < other.index;
    }
  };
  std::vector<Entry> sorted;
  sorted.reserve(points.size());
  for (size_t i = 0; i < points.size(); ++i)
    sorted.push_back({{points[i].x(), points[i].y(), points[i].z()}, i});
  std::sort(sorted.begin(), sorted.end());
  std::vector<size_t> out(points.size());
  for (size_t i = 0; i < sorted.size(); ++i)
    out[sorted[i].index] = i > 0 && sorted[i].point == sorted[i - 1].point
                               ? out[sorted[i - 1].index]
                               : sorted[i].index;
  return out;
}

std::vector<size_t> distinct(const Points& points) {
  const std::vector<size_t> first = first_equals(points);
  std::vector<size_t> out;
  for (size_t i = 0; i < first.size(); ++i)
    if (first[i] == i) out.push_back(i);
  return out;
}

size_t repeats(const Points& points) { return points.size() - distinct(points).size(); }

Points without_repeats(const Points& points) {
  Points out;
  for (const size_t i : distinct(points)) out.push_back(points[i]);
  return out;
}

ShapePoints located_shape_points(const Mesh& mesh) {
  ShapePoints out;
  if (!has_area(mesh)) {
    out.vertex = distinct(mesh.vertices);
    for (const size_t i : out.vertex) out.points.push_back(mesh.vertices[i]);
    return out;
  }
  Body body;
  body.rest = mesh;
  const SurfaceSamples samples =
      SurfaceSampler(body).draw(RngKey{0, 0}.fold("doctor"), kSurfacePoints);
  out.points = samples.on_rest(body);
  for (size_t i = 0; i < samples.size(); ++i) out.vertex.push_back(samples.vertices[3 * i]);
  return out;
}

Points shape_points(const Mesh& mesh) { return located_shape_points(mesh).points; }

PersonShape shape_of(const Mesh& mesh) {
  PersonShape out;
  const Points all = shape_points(mesh);
  out.parts = find_parts(all);
  for (const size_t i : out.parts.judged)
    if (out.parts.part[i] == Part::person) out.points.push_back(all[i]);
  out.size = doctor_detail::normalised(out.points).size;
  return out;
}

UnitGuess guess_unit(double size) {
  UnitGuess out;
  if (!(size > 0) || !std::isfinite(size)) return out;
  double total = kNoPerson, least = 1e9;
  for (const LengthUnit& unit : kUnits) {
    const double deviation = (std::log(size * unit.metres) - kMeanLogSize) / kDeviation;
    total += std::exp(-0.5 * deviation * deviation);
    if (std::abs(deviation) < std::abs(least)) out.unit = unit, least = deviation;
  }
  out.sure = std::exp(-0.5 * least * least) / total;
  return out;
}

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

double quantile(const Points& points, const Vec3& axis, double q) {
  std::vector<double> along;
  for (const Point& p : points) along.push_back(axis.dot(p.cast<double>()));
  return quantile(std::move(along), q);
}

double one_sidedness(const Points& points, double spacing) {
  if (points.empty() || !(spacing > 0)) return 0;
  const double thick = 0.3 * doctor_detail::normalised(points).size, cell = 1.5 * spacing;
  double most = 0;
  // Thirteen directions: axes, and diagonals of the faces and of the cube.
  for (int code = 14; code < 27; ++code) {
    const Vec3 along = Vec3(code / 9 - 1, code / 3 % 3 - 1, code % 3 - 1).normalized();
    const Vec3 right = along.unitOrthogonal(), up = along.cross(right);
    struct Ray {
      double low = 1e300, high = -1e300;
      int hits = 0;
    };
    std::map<std::pair<int64_t, int64_t>, Ray> rays;
    for (const Point& point : points) {
      const Vec3 p = point.cast<double>() / cell;
      Ray& ray = rays[{std::llround(std::clamp(p.dot(right), -1e9, 1e9)),
                       std::llround(std::clamp(p.dot(up), -1e9, 1e9))}];
      const double depth = p.dot(along) * cell;
      ray.low = std::min(ray.low, depth);
      ray.high = std::max(ray.high, depth);
      ++ray.hits;
    }
    double one = 0, all = 0;
    for (const auto& [where, ray] : rays)
      if (ray.hits > 2) {
        ++all;
        if (ray.high - ray.low < thick) ++one;
      }
    if (all >= 0.15 * static_cast<double>(rays.size())) most = std::max(most, one / all);
  }
  return most;
}

Borders borders(const Mesh& mesh) {
  std::vector<std::array<int32_t, 2>> edges;
  for (const Triangle& f : mesh.faces)
    for (size_t k = 0; k < 3; ++k) {
      const int32_t a = f[k], b = f[(k + 1) % 3];
      if (a != b) edges.push_back({std::min(a, b), std::max(a, b)});
    }
  std::sort(edges.begin(), edges.end());
  Borders out;
  Pieces lines(mesh.vertices.size());  // of vertices that borders join
  std::vector<size_t> on_border;
  for (size_t i = 0; i < edges.size();) {
    size_t end = i;
    while (end < edges.size() && edges[end] == edges[i]) ++end;
    if (end - i == 1) {
      ++out.edges;
      lines.join(edges[i][0], edges[i][1]);
      on_border.insert(on_border.end(), edges[i].begin(), edges[i].end());
    }
    i = end;
  }
  std::set<size_t> loops;
  for (const size_t v : on_border) loops.insert(lines.of(v));
  out.loops = loops.size();
  return out;
}

}  // namespace restage
