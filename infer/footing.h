// Puts a figure on the floor: its soles, not its pelvis, decide how high it stands.
#pragma once

#include <optional>

#include "nn/geometry/soles.h"

namespace restage {

/// How high ankle and ball of a foot are that stands flat on the floor, metres.
struct FlatFoot {
  double ankle, ball;
};
/// Of somebody of whom only the joints in some pose are known: a bare foot in proportion to the
/// legs, the mean of MakeHuman's bodies.
FlatFoot bare_foot(const Joints& a);
/// Of a skeleton that stands on y = 0 in its rest pose.
FlatFoot flat_foot(const Joints& rest);

/// How high a sole is meant to be, metres, when A's joints are `a` and B's path is A's times
/// `scale`; left and right. A foot of A that is near the floor, as feet in shoes are, is on it:
/// joints of clouds err by centimetres.
std::array<double, 2> sole_heights(const Joints& a, const FlatFoot& flat, double scale);
/// The same where B's feet are not to go deeper: the floor, or lower where A's foot is (steps that
/// go down).
std::array<double, 2> least_heights(const Joints& a, const FlatFoot& flat, double scale);

/// How far each sole is above where A's foot says while that foot is near the floor, metres; fades
/// as A's foot goes up, and is 0 for a sole that is not above. Legs of another build put a foot
/// that steps beside the body high above the floor.
std::array<double, 2> floating(const Joints& a, const FlatFoot& flat, double scale,
                               const Soles& soles, const Joints& rest, const Pose& pose);

/// Works frame by frame at kFps and looks at no later frame. Figures differ in more than size: a
/// boot lifts an ankle, and legs that are seen a little too short put a pelvis too low. So the
/// whole figure is raised or lowered until the sole of the foot that stands is where A's foot says
/// (sole_heights()): at once in the first frame, then within kSettling seconds. While no foot
/// stands, the figure keeps what it was raised by.
class Footing {
 public:
  explicit Footing(Soles soles) : soles_(std::move(soles)) {}

  /// Changes the height of `pose`, the network's, for the next frame. `rest`: B's rest joints.
  /// `standing`: the chances, 0 to 1, that the left and the right foot stand. Returns how far each
  /// sole is still above where it belongs, metres (FootLock).
  std::array<double, 2> operator()(const Joints& rest, const Joints& a, double scale,
                                   const std::array<double, 2>& standing, Pose* pose);
  /// Feet that are under the floor are raised at once, and let down again within some frames. Those
  /// that float (floating()) are let down, too. To be called when the feet are where they stay.
  void settle_feet(const Joints& rest, const Joints& a, double scale, Pose* pose);
  /// The next frame is the first of another sequence.
  void forget() { raised_.reset(), lifts_ = {}; }

 private:
  Soles soles_;
  std::optional<double> raised_;      ///< metres
  std::array<double, 2> lifts_ = {};  ///< of the feet, in the frame before; below 0: drops
};

}  // namespace restage
