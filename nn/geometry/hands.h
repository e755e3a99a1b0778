// Fingers, which the 22-joint skeleton leaves out: sources and targets that both have them pass
// their turns on.
#pragma once

#include <array>
#include <optional>

#include "nn/geometry/skeleton.h"

namespace restage {

/// Three bones of each finger, from the palm to the tip: left hand, then right; thumb, index,
/// middle, ring, little.
inline constexpr int kFingerBones = 30;
inline constexpr int finger_bone(int side, int finger, int bone) {
  return 15 * side + 3 * finger + bone;
}

/// World rotations from the T-pose; nothing for a bone that is not known.
using FingerTurns = std::array<std::optional<Mat3>, kFingerBones>;

}  // namespace restage
