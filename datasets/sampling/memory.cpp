#include "datasets/sampling/memory.h"

#include <cmath>

#include "nn/models/skeleton.h"

namespace restage {
namespace {

/// Of a density s^-3 exp(-|e| / s), as SkeletonOutput::uncertainty has it.
Vec3 draw_error(Rng& rng, double s) {
  const Vec3 direction(rng.normal(), rng.normal(), rng.normal());
  double length = 0;
  for (int i = 0; i < 3; ++i) length -= s * std::log(1 - rng.uniform());
  return length * direction.normalized();
}

}  // namespace

Memory draw_memory(Rng& rng, const Joints& truth, const Joints& elsewhere) {
  const double mistake = rng.uniform(),
               body = std::exp(rng.uniform(std::log(0.001), std::log(0.02)));
  const bool exchanged = mistake<1.0 / 16, lost = mistake> 1 - 1.0 / 30;
  Memory out;
  Joints errors{};
  for (int j = 0; j < kJoints; ++j) {
    const double s = body * std::exp(0.5 * rng.normal());
    errors[j] = draw_error(rng, s);
    if (kParents[j] >= 0) errors[j] = std::sqrt(0.5) * (errors[j] + errors[kParents[j]]);
    const int from = exchanged ? kMirror[j] : j;
    out.joints[j] = (lost ? elsewhere : truth)[from] + errors[j];
    out.trust[j] = trust_of(s);
  }
  return out;
}

}  // namespace restage
