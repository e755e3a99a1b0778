// Anatomical angles of a figure and the rotations they mean: the alphabet of the built-in motions.
#pragma once

#include <array>

#include "nn/geometry/skeleton.h"

namespace restage {

/// Angles in degrees; 0 everywhere is the T-pose facing +z. Signs: see channel_rotations().
enum PoseChannel : int {
  kYaw,
  kPitch,
  kRoll,  // whole body: left, forward, to the right
  kSpineBend,
  kSpineSide,
  kSpineTwist,  // forward, to the right, to the left
  kNeckNod,
  kNeckSide,
  kNeckTurn,  // down, to the right, to the left
  kLeft,      // then kSideChannels of the left and of the right side
};
enum SideChannel : int {
  kShrug,
  kCollarForward,
  kArmFlex,   ///< swings the lowered arm forward, 180 is overhead
  kArmSide,   ///< -90 hangs, 0 sideways, 90 up; under -90 crosses the body
  kArmTwist,  ///< inward
  kElbow,
  kPronate,
  kWristBend,
  kWristTilt,
  kHipFlex,   ///< forward
  kHipSide,   ///< away from the other leg
  kHipTwist,  ///< toes outward
  kKnee,
  kAnkle,  ///< toes up
  kAnkleRoll,
  kToes,  ///< toes up
  kSideChannels
};
inline constexpr int kChannels = int{kLeft} + 2 * int{kSideChannels};
using Angles = std::array<double, kChannels>;

/// Index of a side's channel, side 0 = left, 1 = right.
constexpr int channel(int side, SideChannel c) {
  return int{kLeft} + side * int{kSideChannels} + int{c};
}

/// Standing at ease, arms hanging.
Angles neutral_angles();
/// Exchanges left and right.
Angles mirrored(const Angles& a);
/// Every angle inside the range of a limber person, eased near the limits (no kinks).
Angles limit(const Angles& a);
/// Local rotations of all joints.
Rotations channel_rotations(const Angles& a);

}  // namespace restage
