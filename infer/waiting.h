// A target that waits while nobody is sure of the source, and that comes back without a jump.
#pragma once

#include <optional>

#include "nn/geometry/skeleton.h"

namespace restage {

/// The pose a share `t` of the way from `a` (t = 0) to `b` (t = 1): every local rotation turns the
/// shortest way, the pelvis goes straight.
Pose between(const Pose& a, const Pose& b, double t);

/// Frames in which a target that has waited comes back to the network's poses: half a second.
inline constexpr int kReturnFrames = 15;

/// Decides frame by frame which pose is shown, at kFps. What it knows of the past is the pose that
/// it showed last, so a sequence pushed frame by frame and the whole sequence give the same bits.
class Waiting {
 public:
  /// A frame that is not believed: the pose shown last is shown again, or `rest` where no pose has
  /// been shown.
  const Pose& wait(const Pose& rest);
  /// A frame that is believed: shows `said`. In the first kReturnFrames frames after wait() the
  /// pose shown moves from the waiting pose to `said`, slowly at both ends; the next frame shows
  /// `said` itself, to the last bit.
  const Pose& go_on(const Pose& said);

 private:
  std::optional<Pose> shown_;  ///< last
  Pose waited_;                ///< the pose shown while waiting
  int away_ = 0;               ///< frames until `said` is shown as it is
};

}  // namespace restage
