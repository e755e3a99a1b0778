// A target that waits while nobody is sure of the source, and that comes back without a jump.
#pragma once

#include <array>
#include <optional>

#include "nn/geometry/skeleton.h"

namespace restage {

/// Frames in which a target that has waited comes back to the network's poses: half a second.
inline constexpr int kReturnFrames = 15;

/// Decides frame by frame which pose is shown, at kFps. What it knows of the past is the pose that
/// it showed last, so a sequence pushed frame by frame and the whole sequence give the same bits.
class Waiting {
 public:
  /// A frame that is not believed: the pose shown last is shown again, or `rest` where no pose has
  /// been shown.
  const Pose& wait(const Pose& rest);
  /// A frame that is believed: shows `said`. In the first of them after wait(), the pose shown
  /// differs from `said` as the waiting pose does: by a rotation of each joint and by a shift of
  /// the pelvis. These shrink to nothing over kReturnFrames frames, while the motion of `said` is
  /// shown in full; the next frame shows `said` itself, to the last bit.
  const Pose& go_on(const Pose& said);

 private:
  std::optional<Pose> shown_;  ///< last
  bool waits_ = false;         ///< wait() was called last
  int away_ = 0;               ///< frames until `said` is shown as it is
  // What took the first believed pose to the waiting pose:
  std::array<Quat, kJoints> turns_;
  Vec3 shift_ = Vec3::Zero();
};

}  // namespace restage
