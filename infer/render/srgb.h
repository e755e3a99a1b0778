// The curve between the numbers of pictures (sRGB) and light.
#pragma once

#include <cmath>

namespace restage {

/// Both from 0 to 1.
inline float srgb_to_linear(float s) {
  return s <= 0.04045f ? s / 12.92f : std::pow((s + 0.055f) / 1.055f, 2.4f);
}
inline float linear_to_srgb(float l) {
  return l <= 0.0031308f ? 12.92f * l : 1.055f * std::pow(l, 1 / 2.4f) - 0.055f;
}

}  // namespace restage
