#include "datasets/doctor/orientation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "autograd/ops/reduce.h"
#include "datasets/doctor/orientation_model.h"

namespace restage {
namespace {

using namespace doctor_detail;

constexpr int kQuarter = kHeadings / 4;

int index_of(const Vec3& direction) {
  int axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  return 2 * axis + (direction[axis] < 0 ? 1 : 0);
}

/// Of each hypothesis: kUps x kHeadings numbers.
Tensor probabilities(const Points& cloud) {
  Tensor seen = Tensor::empty({kUps * kHeadings, kPlaces});
  float* row = seen.data<float>();
  for (int u = 0; u < kUps; ++u)
    for (int h = 0; h < kHeadings; ++h, row += kPlaces)
      look(cloud, hypothesis(u, h), std::span<float, kPlaces>(row, kPlaces));
  Context ctx;
  return softmax(orientation_net()(ctx, Var(seen)), 0).value;
}

/// How much the lowest point of the clouds moves along a direction, but for a few clouds: hardly,
/// if a floor is below.
double floor_moves(const std::vector<Points>& clouds, const Vec3& up) {
  constexpr double kBelow = 0.005;  // share of the points that may be strays
  std::vector<double> lowest;
  for (const Points& cloud : clouds) {
    if (cloud.empty()) continue;
    std::vector<double> heights;
    for (const Point& p : cloud) heights.push_back(p.cast<double>().dot(up));
    const auto at = heights.begin() + static_cast<std::ptrdiff_t>(kBelow * double(heights.size()));
    std::nth_element(heights.begin(), at, heights.end());
    lowest.push_back(*at);
  }
  if (lowest.empty()) return 0;
  std::sort(lowest.begin(), lowest.end());
  const size_t tenth = lowest.size() / 10;
  return lowest[lowest.size() - 1 - tenth] - lowest[tenth];
}

}  // namespace

Vec3 direction(int index) {
  Vec3 out = Vec3::Zero();
  out[index / 2] = index % 2 == 0 ? 1 : -1;
  return out;
}

Mat3 Orientation::turn() const {
  const Vec3 y = direction(up), z = direction(facing);
  Mat3 out;
  out << y.cross(z).transpose(), y.transpose(), z.transpose();
  return out;
}

Mat3 Orientation::exact_turn() const {
  return turn_about_y(-turned * std::numbers::pi / 180) * turn();
}

void OrientationVote::add(const Points& cloud, bool faces) {
  const NormalisedCloud seen = normalised(cloud);
  if (!(seen.size > 0)) return;
  const Tensor p = probabilities(seen.points);
  for (size_t u = 0; u < kUps; ++u)
    for (size_t h = 0; h < kHeadings; ++h) {
      const double share = p.data<float>()[u * kHeadings + h];
      up_[u] += share;
      if (faces) facing_[u][h] += share;
    }
  ++clouds_;
}

Orientation OrientationVote::result() const {
  const int best = static_cast<int>(std::max_element(up_.begin(), up_.end()) - up_.begin());
  Orientation out = result(clouds_ > 0 ? best : 2);
  out.up_sure = clouds_ > 0 ? up_[best] / clouds_ : 1.0 / kUps;
  return out;
}

Orientation OrientationVote::result(int known_up) const {
  Orientation out;
  out.up = known_up;
  out.up_sure = 1;
  out.facing = (known_up + 2) % 6;
  out.facing_sure = 1.0 / 4;
  const auto& facing = facing_[out.up];
  double total = 0, most = -1;
  for (const double x : facing) total += x;
  if (!(total > 0)) return out;
  // Of the heading that is `d` steps from another.
  const auto near = [&](int heading, int d) {
    return facing[(heading + d + kHeadings) % kHeadings];
  };
  const auto mass_around = [&](int heading) {
    double mass = 0;
    for (int d = -kQuarter / 2; d <= kQuarter / 2; ++d)
      mass += near(heading, d) * (std::abs(d) == kQuarter / 2 ? 0.5 : 1.0);
    return mass;
  };
  int best = 0, middle = 0;
  for (int quarter = 0; quarter < 4; ++quarter)
    if (const double mass = mass_around(quarter * kQuarter); mass > most)
      most = mass, best = quarter;
  out.facing = index_of(hypothesis(out.up, best * kQuarter).row(2).transpose().cast<double>());
  out.facing_sure = most / total;
  // The angle: mean over the quarter, wherever it begins, that has most.
  most = -1;
  for (int heading = 0; heading < kHeadings; ++heading)
    if (const double mass = mass_around(heading); mass > most) most = mass, middle = heading;
  double moment = 0, mass = 0;
  for (int d = -kQuarter / 2; d <= kQuarter / 2; ++d) {
    moment += near(middle, d) * d;
    mass += near(middle, d);
  }
  const double steps = std::remainder(middle + moment / mass - best * kQuarter, kHeadings);
  out.turned = steps * 360 / kHeadings;
  out.turned_sure = most / total;
  return out;
}

std::optional<int> up_of_take(const std::vector<Points>& clouds, int given) {
  constexpr double kStands = 0.9, kFloor = 0.15;  // probability; metres
  std::array<int64_t, kUps> stands{};
  for (const Points& cloud : clouds) {
    OrientationVote vote;
    vote.add(cloud);
    const Orientation o = vote.result();
    stands[static_cast<size_t>(o.up)] += o.up_sure >= kStands;
  }
  const auto most = std::max_element(stands.begin(), stands.end()) - stands.begin();
  const double usual = floor_moves(clouds, direction(static_cast<int>(most)));
  const int64_t often = std::max<int64_t>(2, std::ssize(clouds) / 5);
  std::optional<int> best;
  double least = 0;
  for (int up = 0; up < static_cast<int>(kUps); ++up) {
    if (stands[static_cast<size_t>(up)] < often) continue;
    const double moves = floor_moves(clouds, direction(up));
    if (up == given && up != most && (moves > kFloor || 2 * moves > usual)) continue;
    if (!best || moves < least) best = up, least = moves;
  }
  return best;
}

}  // namespace restage
