// Rotations that an extractor reads from the surface, as motion networks take them: beside the
// closed form of the joints, which shows all but twist and the leaves.
#pragma once

#include <array>

#include "nn/models/motion.h"

namespace restage {

inline constexpr std::array<int, 5> kLeaves = {10, 11, 15, 20, 21};  ///< feet, head, wrists

/// Constants, a row per frame. Without MotionInput::turns nothing is known, and all are none.
struct SurfaceTurns {
  Tensor twist;   ///< [n * t, 22] about each posed bone, radians
  Tensor leaves;  ///< [n * t, 5, 3, 3] local rotations of kLeaves
  Tensor beyond;  ///< [n * t, 66] what is left, as rotation vectors in each joint's axes
};
SurfaceTurns surface_turns(const MotionInput& in);

/// Local rotations [n, 22, 3, 3] with those of the leaves [n, 5, 3, 3] in their places.
Var with_leaves(const Var& rotations, const Var& leaves);

}  // namespace restage
