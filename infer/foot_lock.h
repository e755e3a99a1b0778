// Keeps a foot that stands in the place where the foot landed.
#pragma once

#include <optional>

#include "nn/geometry/contact.h"

namespace restage {

/// Works frame by frame at kFps and looks at no later frame. A foot that begins to stand is held in
/// the place where the foot is shown at that moment. Only hip, knee and ankle are turned for that;
/// the pelvis keeps its path. While the foot stands, the place moves towards where the network puts
/// the foot, by a fiftieth of the distance in every frame. Once the foot is lifted, or the network
/// puts the foot more than 6 cm away from the place, the distance shrinks by a quarter in every
/// frame. If it is known where the soles belong, a foot is not held at the height at which it
/// landed: it goes a quarter of the way to its place on the floor in every frame.
class FootLock {
 public:
  /// Changes `pose`, the network's, for the next frame. `rest`: rest joints of the body.
  /// `standing`: the chances, 0 to 1, that the left and the right foot stand. `above`: how far each
  /// sole is above where it belongs, metres (infer/footing.h); without it a foot is held in its
  /// height, too.
  void operator()(const Joints& rest, const std::array<double, 2>& standing, Pose* pose,
                  const std::optional<std::array<double, 2>>& above = {});

 private:
  struct Foot {
    std::optional<Vec3> anchor;  ///< the place in which the foot joint is held; empty: not held
    Vec3 offset = Vec3::Zero();  ///< from the network's foot joint to the foot joint that is shown
  };
  std::array<Foot, 2> feet_;
};

}  // namespace restage
