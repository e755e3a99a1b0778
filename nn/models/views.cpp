#include "nn/models/views.h"

#include <algorithm>
#include <cmath>

#include "autograd/base/error.h"
#include "nn/models/skeleton.h"

namespace restage {
namespace {

constexpr double kSure = 0.8;       // confidence from which on sides are believed
constexpr int kRemembered = 15;     // frames
constexpr double kOpposite = -0.3;  // cosine
// Part of the way towards the left of an unsure answer, per frame.
constexpr double kFollowed = 0.1;
constexpr double kClearly = 0.05;  // metres a joint
constexpr int kBelieved = 60;      // frames

/// The rotation whose x is along `first` and whose y is along the part of `second` at right angles
/// to it; none if the two span no plane.
Mat3 rotation_of(const Vec3& first, const Vec3& second) {
  const Vec3 x = first.normalized(), y = (second - x.dot(second) * x).normalized();
  if (!(first.norm() > 1e-9) || !(y.squaredNorm() > 0.5)) return Mat3::Identity();
  Mat3 out;
  out << x, y, x.cross(y);
  return out;
}

/// The mean of values without the `left_out` smallest and the `left_out` largest.
double middle_of(std::vector<double>& values, size_t left_out) {
  std::sort(values.begin(), values.end());
  double sum = 0;
  for (size_t s = left_out; s < values.size() - left_out; ++s) sum += values[s];
  return sum / static_cast<double>(values.size() - 2 * left_out);
}

/// The direction of the body's left, by hips and shoulders. Zero if they coincide.
Vec3 left_of(const Joints& joints) {
  const Vec3 across = joints[1] - joints[2] + joints[16] - joints[17];
  return across.norm() > 1e-9 ? Vec3(across.normalized()) : Vec3(Vec3::Zero());
}

/// The view with left and right exchanged, so that front and back change places.
View exchanged(const View& view) {
  View out;
  for (size_t j = 0; j < kJoints; ++j) {
    const auto other = static_cast<size_t>(kMirror[j]);
    out.joints[j] = view.joints[other];
    out.log_uncertainty[j] = view.log_uncertainty[other];
    // Times half a turn about the body's own y.
    out.turns[j] << -view.turns[other].col(0), view.turns[other].col(1);
  }
  return out;
}

/// How much nearer the limb's two sides would be to where `before` has them with their names
/// exchanged, metres a joint.
template <size_t N>
double gained(const std::array<int, N>& left, const Joints& seen, const Joints& before) {
  double out = 0;
  for (const int joint : left) {
    const auto l = static_cast<size_t>(joint), r = static_cast<size_t>(kMirror[l]);
    out += (seen[l] - before[l]).norm() + (seen[r] - before[r]).norm();
    out -= (seen[l] - before[r]).norm() + (seen[r] - before[l]).norm();
  }
  return out / (2 * N);
}

template <size_t N>
int keep_limb(const std::array<int, N>& left, const Joints& before, int already,
              std::vector<View>* views) {
  if (already >= kBelieved) return 0;
  size_t count = 0;
  for (View& view : *views) {
    if (gained(left, view.joints, before) < kClearly) continue;
    ++count;
    for (const int joint : left) {
      const auto l = static_cast<size_t>(joint), r = static_cast<size_t>(kMirror[l]);
      std::swap(view.joints[l], view.joints[r]);
      std::swap(view.turns[l], view.turns[r]);
      std::swap(view.log_uncertainty[l], view.log_uncertainty[r]);
    }
  }
  return 2 * count > views->size() ? already + 1 : 0;
}

double mean_confidence(const std::vector<View>& views) {
  double sum = 0;
  for (const View& view : views) {
    std::array<double, kJoints> s;
    for (size_t j = 0; j < kJoints; ++j) s[j] = std::exp(view.log_uncertainty[j]);
    sum += confidence(s) / static_cast<double>(views.size());
  }
  return sum;
}

}  // namespace

SeenJoints turned(const Mat3& turn, const SeenJoints& seen) {
  SeenJoints out = seen;
  for (Vec3& joint : out.joints) joint = turn * joint;
  if (out.turns)
    for (Mat3& r : *out.turns) r = turn * r;
  if (out.left) out.left = turn * *out.left;
  if (!out.upright.isIdentity(0)) out.upright = out.upright * turn.transpose();
  return out;
}

double confidence(const std::array<double, kJoints>& uncertainty) {
  double sum = 0;
  for (const double s : uncertainty) {
    const double r = kNearby / s;
    sum += 1 - std::exp(-r) * (1 + r + r * r / 2);
  }
  return sum / kJoints;
}

double mean_uncertainty(const std::array<double, kJoints>& uncertainty) {
  double logs = 0;
  for (const double s : uncertainty) logs += std::log(s) / kJoints;
  return std::exp(logs);
}

std::array<double, kJoints> radius_of_90(const std::array<double, kJoints>& uncertainty) {
  std::array<double, kJoints> out;
  for (size_t j = 0; j < kJoints; ++j) out[j] = kNinety * uncertainty[j];
  return out;
}

SeenJoints combined(const std::vector<View>& views, bool turns, bool uncertainty,
                    const std::string& source, std::vector<double>& values) {
  SeenJoints out;
  if (turns) out.turns.emplace();
  if (uncertainty) out.uncertainty.emplace();
  const size_t n = views.size(), left_out = n < 8 ? 0 : n / 4;
  values.resize(n);
  for (size_t j = 0; j < kJoints; ++j) {
    for (int c = 0; c < 3; ++c) {
      for (size_t s = 0; s < n; ++s) values[s] = views[s].joints[j][c];
      if (!std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); }))
        throw UnusableCloud(source, "gives joints that are not finite", "check its units: metres");
      out.joints[j][c] = middle_of(values, left_out);
    }
    View::Columns columns = View::Columns::Zero();
    double logs = 0;
    for (const View& view : views) columns += view.turns[j], logs += view.log_uncertainty[j];
    if (turns) (*out.turns)[j] = rotation_of(columns.col(0), columns.col(1));
    if (uncertainty) (*out.uncertainty)[j] = std::exp(logs / static_cast<double>(n));
  }
  return out;
}

void keep_sides(const SeenJoints& before, std::vector<View>* views) {
  if (!before.left || before.since >= kRemembered || mean_confidence(*views) >= kSure) return;
  for (View& view : *views)
    if (left_of(view.joints).dot(*before.left) < kOpposite) view = exchanged(view);
}

std::array<int, 2> keep_limbs(const SeenJoints& before, std::vector<View>* views) {
  constexpr std::array<int, 3> kLeg = {kLeftKnee, kLeftAnkle, kLeftFoot};
  constexpr std::array<int, 2> kArm = {kLeftElbow, kLeftWrist};
  return {keep_limb(kLeg, before.joints, before.exchanged[0], views),
          keep_limb(kArm, before.joints, before.exchanged[1], views)};
}

void remember_sides(const SeenJoints* before, SeenJoints* answer) {
  const Vec3 left = left_of(answer->joints);
  if (answer->uncertainty && confidence(*answer->uncertainty) >= kSure) {
    answer->left = left;
    return;
  }
  if (before == nullptr || !before->left) return;
  answer->since = before->since + 1;
  const Vec3 followed = *before->left + kFollowed * (left - *before->left);
  answer->left = followed.norm() > 1e-9 ? Vec3(followed.normalized()) : *before->left;
}

}  // namespace restage
