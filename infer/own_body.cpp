#include "infer/own_body.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "infer/registration/nearest_detail.h"
#include "nn/geometry/closed_form.h"

namespace restage {
namespace {

constexpr double kReach = 0.05;  // metres: a bone that is so much farther counts a third

double from_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 along = b - a;
  const double length = along.squaredNorm();
  const double t = length > 0 ? std::clamp((p - a).dot(along) / length, 0.0, 1.0) : 0;
  return (p - a - t * along).norm();
}

/// How far a point is from what a joint moves: the bones to its children; of a leaf, half of its
/// own bone's length beyond it.
std::array<double, kJoints> from_bones(const Vec3& p, const Joints& joints) {
  std::array<double, kJoints> out;
  out.fill(std::numeric_limits<double>::infinity());
  std::array<bool, kJoints> leaf;
  leaf.fill(true);
  for (size_t j = 1; j < kJoints; ++j) {
    const auto parent = static_cast<size_t>(kParents[j]);
    leaf[parent] = false;
    out[parent] = std::min(out[parent], from_segment(p, joints[parent], joints[j]));
  }
  for (size_t j = 1; j < kJoints; ++j) {
    if (!leaf[j]) continue;
    const Vec3 on = joints[j] + 0.5 * (joints[j] - joints[static_cast<size_t>(kParents[j])]);
    out[j] = from_segment(p, joints[j], on);
  }
  return out;
}

}  // namespace

Rotations OwnBody::turns(const SeenJoints& seen) const {
  return seen.turns ? *seen.turns : closed_form_rotations(*first_, seen.joints);
}

void OwnBody::add(const Points& cloud, const SeenJoints& seen) {
  if (!first_) first_ = seen.joints;
  const Rotations turned = turns(seen);
  for (const auto& p : cloud) {
    const Vec3 at = p.cast<double>();
    const auto away = from_bones(at, seen.joints);
    std::array<size_t, kJoints> order;
    std::iota(order.begin(), order.end(), size_t{0});
    std::partial_sort(order.begin(), order.begin() + kBones, order.end(),
                      [&](size_t a, size_t b) { return away[a] < away[b]; });
    Point& point = points_.emplace_back();
    double sum = 0;
    for (size_t k = 0; k < kBones; ++k) {
      const size_t j = point.joint[k] = order[k];
      sum += point.weight[k] = std::exp((away[order[0]] - away[j]) / kReach);
      point.place[k] = turned[j].transpose() * (at - seen.joints[j]);
    }
    for (double& w : point.weight) w /= sum;
  }
}

double OwnBody::distance(const Points& cloud, const SeenJoints& seen) const {
  const Rotations turned = turns(seen);
  std::vector<Vec3> posed;
  posed.reserve(points_.size());
  for (const Point& p : points_) {
    Vec3 at = Vec3::Zero();
    for (size_t k = 0; k < kBones; ++k)
      at += p.weight[k] * (seen.joints[p.joint[k]] + turned[p.joint[k]] * p.place[k]);
    posed.push_back(at);
  }
  const NearestPoint nearest(posed);
  double sum = 0;
  for (const auto& p : cloud) sum += std::sqrt(nearest(p.cast<double>()).squared);
  return sum / static_cast<double>(cloud.size());
}

}  // namespace restage
