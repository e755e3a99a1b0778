// What sheets of frames, sheets of figures and films look like.
#pragma once

#include <numbers>

#include "infer/render/image.h"

namespace restage {

inline constexpr Rgb kPaper = {0xf7, 0xf8, 0xfa}, kInk = {0x2b, 0x30, 0x38},
                     kPale = {0x7a, 0x83, 0x90};
inline constexpr int kMargin = 22, kTitle = 34;  // pixels: around the sheet; height of the title
inline constexpr float kView = 0.36f;  // opening angle of the camera, radians: little perspective
inline float radians(double degrees) {
  return static_cast<float>(degrees * std::numbers::pi / 180);
}

}  // namespace restage
