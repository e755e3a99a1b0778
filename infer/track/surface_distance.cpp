#include "infer/track/surface_distance.h"

#include <algorithm>
#include <cmath>

#include "infer/registration/nearest_detail.h"

namespace restage {
namespace {

constexpr size_t kNearVertices = 3;

double from_line(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 along = b - a;
  const double length = along.squaredNorm();
  const double t = length > 0 ? std::clamp((p - a).dot(along) / length, 0.0, 1.0) : 0;
  return (p - a - t * along).norm();
}

double from_face(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = (b - a).cross(c - a);
  const double size = n.squaredNorm();
  if (size > 0) {
    const double u = (c - b).cross(p - b).dot(n), v = (a - c).cross(p - c).dot(n),
                 w = (b - a).cross(p - a).dot(n);
    if (u >= 0 && v >= 0 && w >= 0) return std::abs((p - a).dot(n)) / std::sqrt(size);
  }
  return std::min({from_line(p, a, b), from_line(p, b, c), from_line(p, c, a)});
}

}  // namespace

MiddleAndMost middle_and_most(std::vector<double> distances) {
  if (distances.empty()) return {};
  const auto at = [&](double share) {
    const auto i = static_cast<std::ptrdiff_t>(share * static_cast<double>(distances.size() - 1));
    std::nth_element(distances.begin(), distances.begin() + i, distances.end());
    return distances[static_cast<size_t>(i)];
  };
  return {at(0.5), at(0.95)};
}

SurfaceDistance::SurfaceDistance(const Mesh& mesh)
    : faces_(mesh.faces), about_(mesh.vertices.size()) {
  for (size_t f = 0; f < faces_.size(); ++f)
    for (const int32_t v : faces_[f])
      about_[static_cast<size_t>(v)].push_back(static_cast<int32_t>(f));
}

std::vector<double> SurfaceDistance::operator()(const std::vector<Vec3>& points,
                                                const std::vector<Vec3>& vertices) const {
  const NearestPoint find(vertices);
  std::vector<double> out;
  out.reserve(points.size());
  for (const Vec3& p : points) {
    double least = std::numeric_limits<double>::infinity();
    for (const uint32_t v : find.nearest(p, kNearVertices)) {
      least = std::min(least, (p - vertices[v]).norm());
      for (const int32_t f : about_[v]) {
        const Triangle& t = faces_[static_cast<size_t>(f)];
        least = std::min(least, from_face(p, vertices[t[0]], vertices[t[1]], vertices[t[2]]));
      }
    }
    out.push_back(least);
  }
  return out;
}

}  // namespace restage
