// The built-in motions: parametric performances of about twenty actions, no data needed. A motion
// is a function of (seed, split, number in the split) alone.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

/// Motions per built-in subject. A subject has a posture, tempo and temper of its own, and belongs
/// to one split.
inline constexpr int kMotionsPerSubject = 5;

/// Names of the actions in the order in which a split's motions take them: motion i performs action
/// i modulo their number, so a split with at least that many motions has all.
const std::vector<std::string>& builtin_actions();

/// Motion `index` of a split ("train", "validation", "test"; else InputError), 2 to 6 s at kFps, on
/// builtin_rest_joints(). The lowest foot (hand, knee) stays near the floor y = 0 except in flight,
/// the standing foot hardly slides, and the performance starts near the origin in any heading.
Motion builtin_motion(uint64_t seed, const std::string& split, int index);

/// `train` + `validation` + `test` motions, in this order. Counts must not be negative
/// (InputError).
std::vector<Motion> builtin_motions(uint64_t seed, int train, int validation, int test);

}  // namespace restage
