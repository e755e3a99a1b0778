// Rotations that an extractor reads from the surface, in the form that motion networks take. They
// complete the closed form of the joints, which shows everything but twist and the rotations of
// leaves.
#pragma once

#include <array>

#include "nn/models/motion.h"

namespace restage {

inline constexpr std::array<int, 5> kLeaves = {10, 11, 15, 20, 21};  ///< feet, head, wrists

/// Constants, a row for each frame. Without MotionInput::turns all of them mean no rotation.
struct SurfaceTurns {
  Tensor twist;   ///< [n * t, 22] about each posed bone, radians
  Tensor leaves;  ///< [n * t, 5, 3, 3] local rotations of kLeaves
  /// [n * t, 66] what is left of each joint's rotation then, as rotation vectors in the joint's
  /// axes.
  Tensor beyond;
};
SurfaceTurns surface_turns(const MotionInput& in);

/// Local rotations [n, 22, 3, 3] in which the rotations of the leaves are replaced by `leaves` [n,
/// 5, 3, 3].
Var with_leaves(const Var& rotations, const Var& leaves);

}  // namespace restage
