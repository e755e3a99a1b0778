// A target that waits while nobody is sure of the source, and that comes back without a jump.
#pragma once

#include <array>
#include <optional>

#include "nn/geometry/skeleton.h"

namespace restage {

/// Frames in which a target that has waited comes back to the network's poses: half a second.
inline constexpr int kReturnFrames = 15;

/// Decides frame by frame which pose is shown, at kFps, from the frames so far only: a sequence
/// pushed frame by frame and the whole sequence give the same bits.
class Waiting {
 public:
  /// A frame that is not believed: the pose shown last is shown again, or `rest` where no pose has
  /// been shown.
  const Pose& wait(const Pose& rest);
  /// A frame that is believed: shows `said`. The first call after wait() finds the rotation of each
  /// joint and the shift of the pelvis that take `said` to the waiting pose. The pose shown is
  /// `said` with these rotations and this shift added, which shrink to nothing over kReturnFrames
  /// frames; the frame after them shows `said` itself, to the last bit.
  const Pose& go_on(const Pose& said);

 private:
  std::optional<Pose> shown_;  ///< the pose shown last
  bool waits_ = false;         ///< whether the last call was wait()
  int away_ = 0;               ///< frames until `said` is shown without rotations and shift
  // From the first believed pose to the waiting pose:
  std::array<Quat, kJoints> turns_;
  Vec3 shift_ = Vec3::Zero();
};

}  // namespace restage
