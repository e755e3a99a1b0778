// Poses as the numbers of a glTF animation.
#pragma once

#include <array>
#include <vector>

#include "infer/writers/rig_convention.h"

namespace restage::glb {

/// Unit quaternions (x, y, z, w) whose signs make curves continuous, and the root's place, metres.
class Tracks {
 public:
  explicit Tracks(const RigConvention& rig) : rig_(rig) {}
  /// False: the pose is not finite, and was not taken.
  [[nodiscard]] bool push(const Pose& pose);
  size_t frames() const { return roots_.size() / 3; }
  const std::vector<std::array<float, 4>>& turns() const { return turns_; }  ///< 22 a frame
  const std::vector<float>& roots() const { return roots_; }                 ///< 3 numbers a frame

 private:
  RigConvention rig_;
  std::vector<std::array<float, 4>> turns_;
  std::vector<float> roots_;
};

/// How a node with its convention's axes is turned that turns joint `j` by `local`.
Mat3 in_axes(const RigConvention& rig, size_t j, const Mat3& local);

}  // namespace restage::glb
