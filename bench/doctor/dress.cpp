#include "bench/doctor/dress.h"

#include <array>
#include <cmath>

#include "autograd/base/parallel_each.h"
#include "datasets/benchmark/characters.h"

namespace restage::bench {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// Thickness over the skin of each joint's part of the body, metres.
std::array<double, kJoints> draw_outfit(Rng& rng) {
  std::array<double, kJoints> out{};
  const auto set = [&](std::initializer_list<size_t> joints, double thick) {
    for (const size_t j : joints) out[j] = thick;
  };
  const double shirt = rng.uniform(0, 0.03), trousers = rng.uniform(0, 0.03);
  set({3, 6, 9, 13, 14}, shirt);
  set({0, 1, 2}, std::max(trousers, 0.5 * shirt));
  if (rng.uniform() < 0.7) set({16, 17}, shirt);
  if (rng.uniform() < 0.5) set({18, 19}, shirt * rng.uniform(0.5, 1.5));
  if (rng.uniform() < 0.7) set({4, 5}, trousers * rng.uniform(0.5, 1.7));
  if (rng.uniform() < 0.8) set({7, 8, 10, 11}, rng.uniform(0, 0.02));
  return out;
}

Points normals(const Mesh& mesh) {
  Points out(mesh.vertices.size(), Point::Zero());
  for (const Triangle& f : mesh.faces) {
    const auto at = [&](size_t k) { return mesh.vertices[f[k]]; };
    const Point n = (at(1) - at(0)).cross(at(2) - at(0));
    for (const int32_t v : f) out[v] += n;
  }
  for (Point& n : out)
    if (n.squaredNorm() > 0) n.normalize();
  return out;
}

}  // namespace

Body dressed(const Body& body, const RngKey& key) {
  Body out = body;
  Rng rng(key);
  const std::array<double, kJoints> outfit = draw_outfit(rng);
  Point wave;
  for (int axis = 0; axis < 3; ++axis) wave[axis] = static_cast<float>(25 * rng.normal());
  const auto phase = static_cast<float>(rng.uniform(0, 2 * kPi));
  const Points outwards = normals(body.rest);
  for (size_t v = 0; v < outwards.size(); ++v) {
    double thick = 0;
    for (size_t j = 0; j < kJoints; ++j)
      thick += outfit[j] * body.weights(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(j));
    const float fold = std::sin(wave.dot(body.rest.vertices[v]) + phase);
    out.rest.vertices[v] += static_cast<float>(thick) * (1 + 0.4f * fold) * outwards[v];
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

}  // namespace restage::bench
