#include "datasets/doctor/summary.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "datasets/doctor/examine_detail.h"
#include "datasets/doctor/orientation_model.h"

namespace restage::doctor_detail {
namespace {

uint64_t mixed(uint64_t x) {
  x ^= x >> 33;
  x *= 0xff51afd7ed558ccdULL;
  x ^= x >> 33;
  x *= 0xc4ceb9fe1a85ec53ULL;
  return x ^ (x >> 33);
}

uint64_t content_of(const Points& points) {
  uint64_t sum = points.size();
  for (const Point& p : points) {
    std::array<uint32_t, 3> bits;
    std::memcpy(bits.data(), p.data(), sizeof bits);
    sum += mixed(mixed(mixed(bits[0]) ^ bits[1]) ^ bits[2]);
  }
  return sum;
}

Vec3 extent_direction(int i) {
  const int code = 14 + i;
  return Vec3(code / 9 - 1, code / 3 % 3 - 1, code % 3 - 1).normalized();
}

}  // namespace

Summary summary_of(const Frame& frame, const Points& points) {
  Summary out;
  out.content = content_of(frame.points);
  out.size = normalised(points).size;
  out.sequence = frame.sequence;
  out.number = frame.number;
  out.missing = frame.missing;
  Points some;
  const size_t n = std::min<size_t>(points.size(), 2000);
  for (size_t i = 0; i < n; ++i) some.push_back(points[i * points.size() / n]);
  for (int i = 0; i < kExtents; ++i) {
    out.extent[2 * i] = static_cast<float>(quantile(some, extent_direction(i), 0.02));
    out.extent[2 * i + 1] = static_cast<float>(quantile(some, extent_direction(i), 0.98));
  }
  for (int axis = 0; axis < 3; ++axis)
    out.middle[axis] = static_cast<float>(quantile(some, direction(2 * axis), 0.5));
  return out;
}

double step(const Summary& a, const Summary& b) {
  double sum = 0;
  for (size_t i = 0; i < a.extent.size(); ++i)
    sum += std::pow(static_cast<double>(a.extent[i]) - b.extent[i], 2);
  return std::sqrt(sum / static_cast<double>(a.extent.size()));
}

}  // namespace restage::doctor_detail
