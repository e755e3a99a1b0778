#include "datasets/sampling/things.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "datasets/sampling/intruder.h"

namespace restage {
namespace {

/// Radius of the thing as seen from above: how far its middle is from what it touches.
double reach(const Thing& thing) {
  if (thing.shape == Thing::Shape::ball) return thing.size[0];
  if (thing.shape == Thing::Shape::stick) return thing.size[1];
  return 0.5 * std::min(thing.size[0], thing.size[2]);
}

double height(const Thing& thing) {
  if (thing.shape == Thing::Shape::ball) return 2 * thing.size[0];
  return thing.shape == Thing::Shape::stick ? thing.size[0] : thing.size[1];
}

/// A point of the surface about the middle, before it is turned.
Vec3 surface_point(const Thing& thing, Rng& rng) {
  if (thing.shape == Thing::Shape::ball) {
    Vec3 v;  // in this order, whatever the compiler
    for (int c = 0; c < 3; ++c) v[c] = rng.normal();
    return thing.size[0] * v / std::max(v.norm(), 1e-9);
  }
  if (thing.shape == Thing::Shape::stick) {
    const double along = rng.uniform(-0.5, 0.5), about = rng.uniform(-M_PI, M_PI);
    return {thing.size[1] * std::cos(about), thing.size[0] * along,
            thing.size[1] * std::sin(about)};
  }
  const Vec3& s = thing.size;
  const std::array<double, 3> areas = {s[1] * s[2], s[0] * s[2], s[0] * s[1]};
  double at = rng.uniform() * (areas[0] + areas[1] + areas[2]);
  int side = 0;
  while (side < 2 && at >= areas[static_cast<size_t>(side)])
    at -= areas[static_cast<size_t>(side++)];
  Vec3 out;
  for (int c = 0; c < 3; ++c) out[c] = rng.uniform(-0.5, 0.5);
  out[side] = out[side] < 0 ? -0.5 : 0.5;
  return out.cwiseProduct(s);
}

}  // namespace

Thing draw_thing(Rng& rng) {
  Thing out;
  out.held = rng.uniform() < 0.5;
  out.left = rng.uniform() < 0.5;
  const double shape = rng.uniform();
  if (shape < 0.4) {
    out.shape = Thing::Shape::box;
    const double most = out.held ? 0.4 : 0.6;
    for (int c = 0; c < 3; ++c) out.size[c] = rng.uniform(0.08, most);
  } else if (shape < (out.held ? 0.8 : 0.6)) {
    out.shape = Thing::Shape::stick;
    out.size[0] = rng.uniform(0.2, 1.4);
    out.size[1] = rng.uniform(0.01, 0.05);
  } else {
    out.shape = Thing::Shape::ball;
    out.size[0] = rng.uniform(0.05, 0.2);
  }
  out.turn = out.held ? any_rotation(rng) : turn_about_y(rng.uniform(-M_PI, M_PI));
  out.direction = rng.uniform(-M_PI, M_PI);
  out.gap = rng.uniform(-0.05, 0.12);
  return out;
}

Points thing_points(const Thing& thing, const Joints& joints, double floor, size_t n, Rng& rng) {
  const size_t side = thing.left ? 0 : 1;  // the right joints come after the left ones
  Vec3 middle;
  if (thing.held) {
    const Vec3 &elbow = joints[kLeftElbow + side], &wrist = joints[kLeftWrist + side];
    const Vec3 hand = wrist + 0.08 * (wrist - elbow).normalized();
    // A stick is held somewhere along its length, a ball or a box by its side.
    const double off =
        thing.shape == Thing::Shape::stick ? 2 * thing.gap * thing.size[0] : 0.5 * height(thing);
    middle = hand + thing.turn * Vec3(0, off, 0);
  } else {
    const Vec3& foot = joints[kLeftFoot + side];
    const double far = 0.05 + thing.gap + reach(thing);
    middle = Vec3(foot[0] + far * std::cos(thing.direction), floor + 0.5 * height(thing),
                  foot[2] + far * std::sin(thing.direction));
  }
  Points out;
  for (size_t i = 0; i < n; ++i)
    out.push_back((middle + thing.turn * surface_point(thing, rng)).cast<float>());
  return out;
}

Points smoothing(const Mesh& rest) {
  constexpr int kRounds = 20;
  Points now = rest.vertices;
  std::vector<float> count(now.size(), 0);
  for (const Triangle& t : rest.faces)
    for (const int32_t v : t) count[static_cast<size_t>(v)] += 2;
  Points sum(now.size());
  for (int round = 0; round < kRounds; ++round) {
    std::fill(sum.begin(), sum.end(), Point::Zero());
    for (const Triangle& t : rest.faces)
      for (int k = 0; k < 3; ++k) {
        const auto at = [&](int i) { return static_cast<size_t>(t[(k + i) % 3]); };
        sum[at(0)] += now[at(1)] + now[at(2)];
      }
    for (size_t i = 0; i < now.size(); ++i)
      if (count[i] > 0) now[i] = 0.5f * (now[i] + sum[i] / count[i]);
  }
  for (size_t i = 0; i < now.size(); ++i) now[i] -= rest.vertices[i];
  return now;
}

}  // namespace restage
