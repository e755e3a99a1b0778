// Feet that stand stay where they landed.
#pragma once

#include <optional>

#include "nn/geometry/contact.h"

namespace restage {

/// Causal, at kFps. A foot that begins to stand is held where it is shown then, by hip, knee and
/// ankle alone (the pelvis keeps its path), and lets go of it by and by: a fiftieth of what the
/// network would have is made up for in every frame, all of it within a few frames once it is
/// lifted or more than 6 cm away.
class FootLock {
 public:
  /// `standing`: chance that the left and the right foot stand.
  void operator()(const Joints& rest, const std::array<double, 2>& standing, Pose* pose);

 private:
  struct Foot {
    std::optional<Vec3> anchor;  ///< of the foot joint, while it stands
    Vec3 offset = Vec3::Zero();  ///< of what is shown from what the network says
  };
  std::array<Foot, 2> feet_;
};

}  // namespace restage
