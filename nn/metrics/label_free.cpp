#include "nn/metrics/label_free.h"

#include <algorithm>
#include <cmath>

#include "nn/metrics/surfaces.h"

namespace restage::metrics {
namespace {

/// Left joints that move with a limb; kMirror has the right ones.
constexpr std::array<int, 3> kLeg = {kLeftKnee, kLeftAnkle, kLeftFoot};
constexpr std::array<int, 2> kArm = {kLeftElbow, kLeftWrist};

/// Marks frames in which a pair of limbs is exchanged against the first frame.
template <size_t N>
std::vector<bool> exchanged(std::span<const Joints> frames, const std::array<int, N>& limb) {
  std::vector<bool> out(frames.size(), false);
  for (size_t t = 1; t < frames.size(); ++t) {
    double same = 0, other = 0;
    for (const int left : limb) {
      const auto l = static_cast<size_t>(left);
      const auto r = static_cast<size_t>(kMirror[l]);
      const Joints &now = frames[t], &before = frames[t - 1];
      same += (now[l] - before[l]).norm() + (now[r] - before[r]).norm();
      other += (now[l] - before[r]).norm() + (now[r] - before[l]).norm();
    }
    out[t] = other < same ? !out[t - 1] : out[t - 1];
  }
  const auto changed = std::count(out.begin(), out.end(), true);
  if (2 * changed > std::ssize(out)) out.flip();
  return out;
}

}  // namespace

std::optional<std::array<double, kJoints>> bone_length_spread(std::span<const Joints> frames) {
  if (frames.size() < 2) return std::nullopt;
  std::array<double, kJoints> out{};
  const auto n = static_cast<double>(frames.size());
  for (size_t j = 1; j < kJoints; ++j) {
    const auto parent = static_cast<size_t>(kParents[j]);
    double sum = 0, squares = 0;
    for (const Joints& f : frames) sum += (f[j] - f[parent]).norm() / n;
    for (const Joints& f : frames) squares += std::pow((f[j] - f[parent]).norm() - sum, 2);
    out[j] = std::sqrt(squares / (n - 1));
  }
  return out;
}

std::vector<bool> side_changes(std::span<const Joints> frames) {
  std::vector<bool> out = exchanged(frames, kLeg);
  const std::vector<bool> arms = exchanged(frames, kArm);
  for (size_t t = 0; t < out.size(); ++t) out[t] = out[t] || arms[t];
  return out;
}

std::vector<double> jitter(std::span<const Joints> frames) {
  constexpr std::array<double, 7> kParabola = {-2, 3, 6, 7, 6, 3, -2};  // over 21
  constexpr size_t kAround = kParabola.size() / 2;
  if (frames.size() < kParabola.size()) return {};
  std::vector<double> out(frames.size(), 0.0);
  for (size_t t = kAround; t + kAround < frames.size(); ++t)
    for (size_t j = 0; j < kJoints; ++j) {
      Vec3 smooth = Vec3::Zero();
      for (size_t k = 0; k < kParabola.size(); ++k)
        smooth += kParabola[k] / 21 * frames[t + k - kAround][j];
      out[t] += (frames[t][j] - smooth).norm() / kJoints;
    }
  return out;
}

std::optional<double> floor_spread(std::vector<double> lowest) {
  constexpr double kStanding = 0.1;  // metres
  if (lowest.size() < 2) return std::nullopt;
  const auto floor = percentile(lowest, 0.05);
  if (!floor) return std::nullopt;
  std::vector<double> off;
  for (const double y : lowest)
    if (std::abs(y - *floor) < kStanding) off.push_back(std::abs(y - *floor));
  return percentile(std::move(off), 0.5);
}

}  // namespace restage::metrics
