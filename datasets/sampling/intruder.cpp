#include "datasets/sampling/intruder.h"

#include <array>
#include <cmath>

#include "datasets/readers/clouds/non_finite.h"

namespace restage {
namespace {

constexpr std::array<int, 8> kLimbs = {16, 17, 18, 19, 1, 2, 4, 5};  // arms, forearms, legs, shins

}  // namespace

Mat3 any_rotation(Rng& rng) {
  const double a = rng.normal(), b = rng.normal(), c = rng.normal(), d = rng.normal();
  return Quat(a, b, c, d).normalized().toRotationMatrix();
}

float hangs_on(int joint, std::span<const float, kJoints> weights) {
  std::array<bool, kJoints> hangs{};
  float share = 0;
  for (size_t j = 0; j < kJoints; ++j) {
    const int parent = kParents[j];
    hangs[j] = static_cast<int>(j) == joint || (parent >= 0 && hangs[static_cast<size_t>(parent)]);
    if (hangs[j]) share += weights[j];
  }
  return share;
}

Mesh limb_of(const Body& body, int joint) {
  std::vector<bool> kept;
  for (Eigen::Index v = 0; v < body.weights.rows(); ++v)
    kept.push_back(hangs_on(joint, std::span<const float, kJoints>(body.weights.row(v).data(),
                                                                   kJoints)) >= 0.5f);
  Mesh out = body.rest;
  keep_points(kept, out.vertices, out.faces);
  return out;
}

Intruder draw_intruder(Rng& rng, size_t bodies) {
  Intruder out;
  out.body = rng.below(bodies);
  out.joint = kLimbs[rng.below(kLimbs.size())];
  out.turn = any_rotation(rng);
  const double direction = rng.uniform(-M_PI, M_PI), far = rng.uniform(0.3, 0.9);
  out.place = Vec3(far * std::cos(direction), rng.uniform(-0.6, 0.6), far * std::sin(direction));
  return out;
}

void put_intruder(const Intruder& intruder, const Vec3& middle, Points& limb) {
  if (limb.empty()) return;
  const Vec3 own = centroid(limb).cast<double>();
  for (Point& p : limb)
    p = (middle + intruder.place + intruder.turn * (p.cast<double>() - own)).cast<float>();
}

}  // namespace restage
