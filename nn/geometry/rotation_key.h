// Rotations as keys of an animation.
#pragma once

#include <array>

#include "nn/geometry/skeleton.h"

namespace restage {

/// x, y, z, w.
using RotationKey = std::array<float, 4>;

/// q and -q are the same rotation, and a player takes the short way from key to key only if their
/// signs agree. So this is the one nearer to the key before; at first (null) the one with w >= 0.
inline RotationKey rotation_key(const Quat& q, const RotationKey* before) {
  Eigen::Vector4d c = q.coeffs();
  double side = c[3];
  if (before != nullptr) {
    const RotationKey& b = *before;
    side = c[0] * b[0] + c[1] * b[1] + c[2] * b[2] + c[3] * b[3];
  }
  if (side < 0) c = -c;
  return {static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2]),
          static_cast<float>(c[3])};
}

}  // namespace restage
