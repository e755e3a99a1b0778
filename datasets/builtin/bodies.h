// The built-in bodies: parametric people, no data needed. 22 joints, one closed surface, skinning
// weights. Every body is a function of (seed, split, number in the split) alone, so asking for more
// bodies never changes the others, and no body is in two splits.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

/// The licence of built-in bodies and motions, as files say it. The code that makes them is under
/// Restage's own.
inline constexpr const char* kBuiltinLicense = "CC0-1.0";

/// Body `index` of a split ("train", "validation", "test"; else InputError). T-pose facing +z, left
/// = +x, arms along x, lowest vertex at y = 0, 1.45 to 2.0 m high, about 5,000 vertices. The
/// surface is closed and oriented (counter-clockwise from outside); weights: at most 4 joints per
/// vertex. `one_mesh`: with the faces of the average body, so that vertices of all bodies
/// correspond.
Body builtin_body(uint64_t seed, const std::string& split, int index, bool one_mesh = false);

/// `train` + `validation` + `test` bodies, in this order. Built in parallel. Counts must not be
/// negative (InputError).
std::vector<Body> builtin_bodies(uint64_t seed, int train, int validation, int test,
                                 bool one_mesh = false);

/// Neither of a sex nor of a split: who stands in where only a skeleton is known.
Body builtin_average_body();

/// Rest joints of the average built-in body in metres: the skeleton of the built-in motions.
Joints builtin_rest_joints();

}  // namespace restage
