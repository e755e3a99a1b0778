// A body whose shape is a sum of directions, posed by linear blend skinning: SMPL (Loper et al.,
// 2015) without its pose offsets.
#pragma once

#include <vector>

#include "autograd/tape/tape.h"

namespace restage {

/// Metres; a shape is `b` numbers, of which each moves every vertex and every joint along a line.
struct LinearBody {
  Tensor mean;               ///< [v, 3]: vertices of the shape of zeros, at rest
  Tensor directions;         ///< [v, 3, b]
  Tensor joint_mean;         ///< [j, 3]
  Tensor joint_directions;   ///< [j, 3, b]
  Tensor weights;            ///< [v, j]: skin
  std::vector<int> parents;  ///< of the joints, which come before their children; -1: the root
};

/// Points at rest [n, p, 3] of shapes [n, b]: mean [p, 3], directions [p, 3, b]. They are vertices
/// or joints of a LinearBody.
Var shaped(const Tensor& mean, const Tensor& directions, const Var& shape);

/// Bodies of shapes [n, b] in poses [n, t, 3 j] (axis-angle, radians) -> [n, t, v, 3]. The root
/// joint stays where it rests.
Var pose_body(const LinearBody& body, const Var& shape, const Var& poses);

}  // namespace restage
