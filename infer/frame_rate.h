// Poses of a result at another rate than 30 frames a second.
#pragma once

#include <optional>
#include <vector>

#include "infer/system.h"

namespace restage {

/// Takes frames at kFps and gives those at `fps`: frame k is the pose at k / fps seconds, by slerp
/// of local rotations and linear interpolation of the root's place. A frame that falls on one of
/// the source's is that frame; others have no joints and vertices.
class FrameRate {
 public:
  explicit FrameRate(double fps) : fps_(fps) {}
  /// The frames that lie between the frame before and this one, or on this one.
  std::vector<RetargetedFrame> push(const RetargetedFrame& frame);
  /// How many frames come of so many at kFps.
  static int64_t count(int64_t frames, double fps);

 private:
  double fps_;
  int64_t in_ = 0, out_ = 0;  ///< frames taken and given
  std::optional<RetargetedFrame> before_;
};

}  // namespace restage
