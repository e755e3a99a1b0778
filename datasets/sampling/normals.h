// Three standard normal numbers at the price of one draw: point noise is drawn a thousand times per
// cloud.
#pragma once

#include <cmath>

#include "autograd/base/rng.h"
#include "nn/geometry/body.h"

namespace restage {

/// Vector number `index` of the stream: Box-Muller on the four 32-bit words of one draw, so no
/// number lies beyond 6.7 standard deviations.
inline Point normal3(const RngKey& key, uint64_t index) {
  const auto word = philox(key, index);
  const auto radius = [](uint32_t w) {
    const double u = (static_cast<double>(w) + 0.5) * 0x1.0p-32;
    return std::sqrt(-2.0f * std::log(static_cast<float>(u)));
  };
  const auto angle = [](uint32_t w) {
    return 6.2831853f * (static_cast<float>(w >> 8) * 0x1.0p-24f);
  };
  const float r = radius(word[0]), a = angle(word[1]);
  return Point(r * std::cos(a), r * std::sin(a), radius(word[2]) * std::cos(angle(word[3])));
}

}  // namespace restage
