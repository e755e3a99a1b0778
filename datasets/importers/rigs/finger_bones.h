// Which bones below a hand are its fingers.
#pragma once

#include <string>
#include <vector>

#include "nn/geometry/hands.h"

namespace restage {

/// Numbers of bones, -1 for those that are not there; as FingerTurns.
using FingerBones = std::array<int, kFingerBones>;

/// By English and Japanese names of fingers ("LeftHandIndex1", "f_ring.01.L", "thumbProximal",
/// "親指１") or by their numbers ("Finger0" or "finger1-1", of which the first is the thumb), and
/// by how they hang together. Bones inside the palm, which only some rigs have, are no fingers; the
/// thumb's are. `parents`: -1 or an earlier bone. `hands`: left and right.
FingerBones find_fingers(const std::vector<std::string>& names, const std::vector<int>& parents,
                         const std::array<int, 2>& hands);

}  // namespace restage
