#include "infer/track/scan.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "infer/registration/nearest_detail.h"
#include "infer/registration/registration.h"

namespace restage {
namespace {

constexpr size_t kPlanePoints = 10;     // that a plane is laid through
constexpr double kLeastCosine = 0.5;    // between a point's normal and its vertex'
constexpr double kFarthestMatch = 3.0;  // widths

Vec3 plane_normal(const std::vector<Vec3>& points, const std::vector<uint32_t>& near) {
  Vec3 middle = Vec3::Zero();
  for (const uint32_t i : near) middle += points[i];
  middle /= static_cast<double>(near.size());
  Mat3 spread = Mat3::Zero();
  for (const uint32_t i : near) spread += (points[i] - middle) * (points[i] - middle).transpose();
  Eigen::SelfAdjointEigenSolver<Mat3> axes;
  axes.computeDirect(spread);
  return axes.eigenvectors().col(0).normalized();
}

}  // namespace

Scan make_scan(const Points& cloud, const std::string& source) {
  Scan out;
  out.points = thinned(cloud, kScanCell, source);
  const NearestPoint find(out.points);
  out.normals.reserve(out.points.size());
  for (const Vec3& p : out.points)
    out.normals.push_back(plane_normal(out.points, find.nearest(p, kPlanePoints)));
  return out;
}

std::vector<SurfaceMatch> match_surface(const Scan& scan, const std::vector<Vec3>& vertices,
                                        const std::vector<Vec3>& normals, double width) {
  const NearestPoint find(vertices);
  const double square = width * width;
  std::vector<SurfaceMatch> out;
  out.reserve(scan.points.size());
  for (size_t i = 0; i < scan.points.size(); ++i) {
    const auto [v, squared] = find(scan.points[i]);
    if (squared > kFarthestMatch * kFarthestMatch * square) continue;
    if (std::abs(normals[v].dot(scan.normals[i])) < kLeastCosine) continue;
    const double w = square / (square + squared);
    out.push_back({v, scan.points[i], w * w});
  }
  return out;
}

}  // namespace restage
