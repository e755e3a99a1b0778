// Bones of one person have one length: what noise of a frame does to them is taken back.
#pragma once

#include <array>
#include <optional>

#include "nn/geometry/skeleton.h"

namespace restage {

/// Joints of one person, frame by frame. The length of every bone is the mean of what was seen so
/// far, frames of certain joints counting more; the first frames are nearly as they were seen. Then
/// joints are moved as little as gives the bones these lengths, uncertain joints more than certain
/// ones. Causal; memory does not grow.
class SteadyBones {
 public:
  /// `uncertainty`: metres, where it is known.
  Joints operator()(const Joints& seen,
                    const std::optional<std::array<double, kJoints>>& uncertainty);

 private:
  std::array<double, kJoints> sum_{}, weight_{};  // of the bone to each joint's parent
};

}  // namespace restage
