#include "datasets/doctor/orientation_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <set>
#include <string>

#include "datasets/doctor/shape.h"
#include "datasets/embedded_weights.h"
#include "nn/weights/state.h"

namespace restage::doctor_detail {
namespace {

constexpr size_t kMostLooked = 4096;  // of a large cloud, evenly spaced in the list
constexpr float kThin = 0.12f;        // one point per cube of this edge, in units of the size

constexpr float kFar = 1e4f;  // in the same unit

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

void look(const Points& points, const Eigen::Matrix3f& turn, std::span<float, kPlaces> shares) {
  std::fill(shares.begin(), shares.end(), 0.0f);
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
    float* at = shares.data() + (i * kUpwards + j) * kForward + k;
    for (const int dx : {0, 1})
      for (const int dy : {0, 1})
        for (const int dz : {0, 1})
          at[(dx * kUpwards + dy) * kForward + dz] +=
              (dx ? fx : 1 - fx) * (dy ? fy : 1 - fy) * (dz ? fz : 1 - fz);
  }
  const float scale = 1.0f / static_cast<float>(std::max<size_t>(points.size(), 1));
  for (float& share : shares) share = std::sqrt(share * scale);
}

Var OrientationNet::operator()(Context& ctx, const Var& seen) const {
  const Var wide = relu_dropout(ctx, layers[0](ctx, seen), 0.1);
  return layers[2](ctx, layers[1](ctx, wide, Activation::relu));
}

const OrientationNet& orientation_net() {
  static const auto net = [] {
    auto out = std::make_unique<OrientationNet>(Init{});
    const std::string where = "the doctor's built-in network";
    load_state(*out, parse_safetensors(embedded::orientation_weights(), where), "", where);
    return out;
  }();
  return *net;
}

Eigen::Matrix3f hypothesis(int up, int heading) {
  const Vec3 y = direction(up), z = Vec3::Unit((up / 2 + 1) % 3);
  Mat3 stand;  // rows: across, up, forward
  stand << y.cross(z).transpose(), y.transpose(), z.transpose();
  Mat3 turn = turn_about_y(-2 * std::numbers::pi * heading / kHeadings) * stand;
  if (heading % (kHeadings / 4) == 0) turn = turn.array().round();  // exactly a permutation
  return turn.cast<float>();
}

}  // namespace restage::doctor_detail
