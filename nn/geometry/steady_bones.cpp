#include "nn/geometry/steady_bones.h"

#include <algorithm>

namespace restage {
namespace {

constexpr int kRounds = 12;          // over all bones; then the lengths are made exact
constexpr double kLeastSure = 1e-3;  // metres: nobody knows a joint better
constexpr double kUsual = 0.02;      // metres, where uncertainties are not known

/// Moves both ends of a bone along it, by their variances, until it has its length.
void stretch(double length, double at, double of_parent, Vec3* joint, Vec3* parent) {
  const Vec3 along = *joint - *parent;
  const double now = along.norm();
  if (now <= 0) return;
  const Vec3 step = (length - now) / (now * (at + of_parent)) * along;
  *joint += at * step;
  *parent -= of_parent * step;
}

}  // namespace

Joints SteadyBones::operator()(const Joints& seen,
                               const std::optional<std::array<double, kJoints>>& uncertainty) {
  std::array<double, kJoints> variance, length{};
  for (size_t j = 0; j < kJoints; ++j) {
    const double u = uncertainty ? std::max((*uncertainty)[j], kLeastSure) : kUsual;
    variance[j] = u * u;
  }
  for (size_t j = 1; j < kJoints; ++j) {
    const auto p = static_cast<size_t>(kParents[j]);
    const double weight = 1 / (variance[j] + variance[p]);
    sum_[j] += weight * (seen[j] - seen[p]).norm();
    weight_[j] += weight;
    length[j] = sum_[j] / weight_[j];
  }
  Joints out = seen;
  for (int round = 0; round < kRounds; ++round)
    for (size_t j = 1; j < kJoints; ++j) {
      const auto p = static_cast<size_t>(kParents[j]);
      stretch(length[j], variance[j], variance[p], &out[j], &out[p]);
    }
  for (size_t j = 1; j < kJoints; ++j) {
    const auto p = static_cast<size_t>(kParents[j]);
    stretch(length[j], 1, 0, &out[j], &out[p]);
  }
  return out;
}

}  // namespace restage
