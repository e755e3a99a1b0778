// Rotations of a body model's joints, in the shapes in which files hold them.
#pragma once

#include <string>
#include <vector>

#include "datasets/readers/arrays/body_parameters.h"
#include "nn/geometry/skeleton.h"

namespace restage {

/// Local rotations of the 22 joints, and how many joints the file has (22, 24 of SMPL, 52 of
/// SMPL-H, 55 of SMPL-X; of files that keep hands by themselves 22).
struct BodyRotations {
  std::vector<std::vector<Quat>> local;  ///< per frame
  /// Of the 30 joints of both hands, as SMPL-H counts them: index, middle, little, ring, thumb of
  /// the left, then of the right. Empty: not asked for, or the file's array of all joints has none.
  std::vector<std::vector<Quat>> hands;
  int64_t joints = 0;
  std::string layout;  ///< for the report: "poses [61, 156]"
  double largest = 0;  ///< axis-angle numbers: the largest angle, radians; of matrices 0
};

/// From one array of all joints or from those of the root and the rest: axis-angle numbers ([F, 3
/// J], [F, J, 3]), rotation matrices ([F, J, 3, 3], of one frame [J, 3, 3]), quaternions ([F, J,
/// 4]: the number that is largest on average is w) or 6 numbers of a matrix ([F, J, 6]: its first
/// two columns, one after the other or in turn, or rows, as knees and elbows bend), with or without
/// axes of length 1, flat or not. What had to be guessed is in `layout`.
/// InputError: other shapes and numbers of joints, no rotations, not finite.
BodyRotations read_body_rotations(const ArraySource& file, const BodyParameters& names,
                                  bool with_hands = false);

/// How many joints an array of such a shape turns, of the root's, the others' or all; 0 for a shape
/// that is none of a body model's.
int64_t rotated_joints(const std::vector<int64_t>& shape);

}  // namespace restage
