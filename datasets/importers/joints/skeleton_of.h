// Somebody's skeleton in T-pose, found from positions of joints and turns that a network believes.
// Internal to this folder.
#pragma once

#include <vector>

#include "datasets/importers/joints/clean.h"

namespace restage::joints_detail {

/// The turn that takes the directions `from` nearest to `to`, of which each counts by its weight;
/// at least as near to `guess` as what they leave open.
Mat3 turn_between(const std::vector<Vec3>& from, const std::vector<Vec3>& to, const Mat3& guess);

/// The joints of a T-pose, metres, y up, facing +z, the pelvis at 0. Lengths: the median over the
/// frames, for bones that are not known those of an average body of the same size. Directions: as
/// seen from the parent's turn, for limbs as in a T-pose. `turns`: world turns of each frame.
Joints find_skeleton(const std::vector<MappedFrame>& frames, const std::vector<Rotations>& turns);

}  // namespace restage::joints_detail
