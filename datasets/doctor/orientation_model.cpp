#include "datasets/doctor/orientation_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

namespace restage::doctor_detail {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr size_t kMostLooked = 4096;  // of a large cloud, evenly spaced in the list
constexpr float kThin = 0.12f;        // one point per cube of this edge, in units of the size

constexpr int16_t kPrior[] = {
// hundredths
#include "datasets/doctor/orientation_prior.inc"
};
static_assert(std::size(kPrior) % kPlaces == 0, "fit the prior again: doctor_bench fit");
constexpr float kFar = 1e4f;  // in the same unit

float median(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Moves the median to the origin and makes the median distance 1.
void normalise(NormalisedCloud& cloud) {
  std::vector<float> values(cloud.points.size());
  const auto median_of = [&](auto&& value) {
    std::transform(cloud.points.begin(), cloud.points.end(), values.begin(), value);
    return median(values);
  };
  Point middle;
  for (int axis = 0; axis < 3; ++axis)
    middle[axis] = median_of([&](const Point& p) { return p[axis]; });
  float size = median_of([&](const Point& p) { return (p - middle).norm(); });
  if (!std::isfinite(size)) size = 0;  // numbers near the end of float's range are no person
  const auto bounded = [](const Point& p) { return Point(p.cwiseMax(-kFar).cwiseMin(kFar)); };
  for (Point& p : cloud.points) p = size > 0 ? bounded((p - middle) / size) : Point::Zero();
  cloud.middle += cloud.size * middle;
  cloud.size *= size;
}

/// One point of each cube of edge kThin.
void thin(Points& points) {
  std::set<std::array<int, 3>> taken;
  const auto cube = [](float x) { return static_cast<int>(std::floor(x / kThin)); };
  std::erase_if(points, [&](const Point& p) {
    return !taken.insert({cube(p.x()), cube(p.y()), cube(p.z())}).second;
  });
}

}  // namespace

NormalisedCloud normalised(const Points& points) {
  NormalisedCloud out;
  if (points.empty()) return out;
  const size_t n = std::min(points.size(), kMostLooked);
  for (size_t i = 0; i < n; ++i) out.points.push_back(points[i * points.size() / n]);
  out.size = 1;
  normalise(out);
  thin(out.points);
  normalise(out);
  return out;
}

void look(const Points& points, const Eigen::Matrix3f& turn, Places& out) {
  std::array<float, kPlaces> share{};
  const auto along = [](float x, int n) {
    return std::clamp(x, 0.0f, static_cast<float>(n) - 1.001f);
  };
  for (const Point& point : points) {
    const Point p = turn * point / kCell;
    const float x = along(std::abs(p.x()), kAcross), y = along(p.y() + kUpwards / 2, kUpwards),
                z = along(p.z() + kForward / 2, kForward);
    const int i = static_cast<int>(x), j = static_cast<int>(y), k = static_cast<int>(z);
    const float fx = x - static_cast<float>(i), fy = y - static_cast<float>(j),
                fz = z - static_cast<float>(k);
    float* at = share.data() + (i * kUpwards + j) * kForward + k;
    for (const int dx : {0, 1})
      for (const int dy : {0, 1})
        for (const int dz : {0, 1})
          at[(dx * kUpwards + dy) * kForward + dz] +=
              (dx ? fx : 1 - fx) * (dy ? fy : 1 - fy) * (dz ? fz : 1 - fz);
  }
  out.place.clear();
  out.share.clear();
  const float scale = 1.0f / static_cast<float>(std::max<size_t>(points.size(), 1));
  for (int i = 0; i < kPlaces; ++i)
    if (share[static_cast<size_t>(i)] > 0) {
      out.place.push_back(i);
      out.share.push_back(std::sqrt(share[static_cast<size_t>(i)] * scale));
    }
}

float score(std::span<const float> coefficients, const Places& at, float* kinds) {
  constexpr size_t kMost = 16;
  std::array<float, kMost> each{};
  const size_t n = std::min(coefficients.size() / kPlaces, kMost);
  float most = -1e30f, total = 0;
  for (size_t k = 0; k < n; ++k) {
    const float* of = coefficients.data() + k * kPlaces;
    for (size_t i = 0; i < at.place.size(); ++i) each[k] += of[at.place[i]] * at.share[i];
    most = std::max(most, each[k]);
  }
  for (size_t k = 0; k < n; ++k) total += (each[k] = std::exp(each[k] - most));
  if (kinds != nullptr)
    for (size_t k = 0; k < n; ++k) kinds[k] = each[k] / total;
  return most + std::log(total);
}

Eigen::Matrix3f hypothesis(int up, int heading) {
  const int axis = up / 2;
  Vec3 y = Vec3::Zero(), z = Vec3::Zero();
  y[axis] = up % 2 == 0 ? 1 : -1;
  z[(axis + 1) % 3] = 1;
  Mat3 stand;  // rows: across, up, forward
  stand << y.cross(z).transpose(), y.transpose(), z.transpose();
  Mat3 turn = turn_about_y(-2 * kPi * heading / kHeadings) * stand;
  if (heading % (kHeadings / 4) == 0) turn = turn.array().round();  // exactly a permutation
  return turn.cast<float>();
}

std::span<const float> orientation_prior() {
  static const auto prior = [] {
    std::array<float, std::size(kPrior)> out;
    for (size_t i = 0; i < out.size(); ++i) out[i] = static_cast<float>(kPrior[i]) / 100;
    return out;
  }();
  return prior;
}

}  // namespace restage::doctor_detail
