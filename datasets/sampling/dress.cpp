#include "datasets/sampling/dress.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "autograd/base/parallel_each.h"
#include "nn/geometry/box.h"
#include "nn/geometry/normals.h"

namespace restage {
namespace {

/// 0 on the face and below, 1 on top and behind, seen from the middle of the skull.
double hairiness(const Point& direction) {
  const double up = direction.y(), ahead = direction.z();
  const double line = up - 0.9 * ahead - 0.05;  // from the forehead down behind the ears
  return std::clamp(3.0 * line, 0.0, 1.0);
}

}  // namespace

float Outfit::thickness(const float* weights, const Point& at_rest) const {
  double sum = 0;
  for (size_t j = 0; j < kJoints; ++j) sum += thick[j] * static_cast<double>(weights[j]);
  float out = static_cast<float>(sum) * (1 + 0.4f * std::sin(wave.dot(at_rest) + phase));
  if (hair > 0 && weights[kHead] > 0.9f)
    out += static_cast<float>(hair * hairiness((at_rest - skull).normalized()));
  return out;
}

Outfit draw_outfit(Rng& rng) {
  Outfit out;
  const auto set = [&](std::initializer_list<size_t> joints, double thick) {
    for (const size_t j : joints) out.thick[j] = thick;
  };
  const double shirt = rng.uniform(0, 0.03), trousers = rng.uniform(0, 0.03);
  set({3, 6, 9, 13, 14}, shirt);
  set({0, 1, 2}, std::max(trousers, 0.5 * shirt));
  if (rng.uniform() < 0.7) set({16, 17}, shirt);
  if (rng.uniform() < 0.5) set({18, 19}, shirt * rng.uniform(0.5, 1.5));
  if (rng.uniform() < 0.7) set({4, 5}, trousers * rng.uniform(0.5, 1.7));
  if (rng.uniform() < 0.8) set({7, 8, 10, 11}, rng.uniform(0, 0.02));
  for (int axis = 0; axis < 3; ++axis) out.wave[axis] = static_cast<float>(25 * rng.normal());
  out.phase = static_cast<float>(rng.uniform(0, 2 * std::numbers::pi));
  return out;
}

Outfit draw_outfit(Rng& rng, const Joints& rest) {
  constexpr double kOverJoint = 0.09;  // the joint is where the skull sits on the neck
  Outfit out = draw_outfit(rng);
  if (rng.uniform() < 0.7) out.hair = rng.uniform(0.01, 0.05);
  out.skull = (rest[kHead] + Vec3(0, kOverJoint, 0)).cast<float>();
  return out;
}

void add_hair(Body& body, double thickness, const RngKey& key) {
  if (!(thickness > 0)) return;
  const auto on_head = [&](size_t v) { return body.weights(v, kHead) > 0.9f; };
  Points& x = body.rest.vertices;
  Box head;
  for (size_t v = 0; v < x.size(); ++v)
    if (on_head(v)) head.extend(x[v]);
  const Point low = head.min(), high = head.max();
  if (!(high.y() > low.y())) return;
  Point middle = 0.5f * (low + high);
  middle.y() = high.y() - 0.45f * (high.y() - low.y());
  Rng rng(key);
  Eigen::Matrix<double, 6, 3> waves;  // locks: a few waves over the skull
  std::array<double, 6> phase;
  for (int k = 0; k < 6; ++k) {
    for (int c = 0; c < 3; ++c) waves(k, c) = 9.0 * rng.normal();
    phase[k] = rng.uniform(0, 2 * std::numbers::pi);
  }
  for (size_t v = 0; v < x.size(); ++v) {
    if (!on_head(v)) continue;
    const Point way = (x[v] - middle).normalized();
    double lock = 0;
    for (int k = 0; k < 6; ++k)
      lock += std::sin(waves.row(k).dot(way.cast<double>()) + phase[k]) / 6;
    const double out = thickness * hairiness(way) * (1 + 0.8 * lock);
    x[v] += static_cast<float>(out) * way;
  }
}

Body dressed(const Body& body, const RngKey& key) {
  Body out = body;
  Rng rng(key);
  const Outfit outfit = draw_outfit(rng);
  const Points outwards = vertex_normals<Point>(body.rest.vertices, body.rest.faces, Point::Zero());
  for (size_t v = 0; v < outwards.size(); ++v) {
    const float* weights = body.weights.data() + v * kJoints;
    out.rest.vertices[v] += outfit.thickness(weights, body.rest.vertices[v]) * outwards[v];
  }
  if (rng.uniform() < 0.7) add_hair(out, rng.uniform(0.01, 0.05), key.fold("hair"));
  return out;
}

Corpus dressed(const Corpus& corpus, uint64_t seed) {
  Corpus out = corpus;
  const RngKey key = RngKey{seed, 0}.fold("dressed");
  parallel_each(std::ssize(out.bodies), 1, [&](int64_t i) {
    const auto b = static_cast<size_t>(i);
    out.bodies[b] = dressed(corpus.bodies[b], key.fold(b));
  });
  return out;
}

}  // namespace restage
