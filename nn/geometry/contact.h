// Feet that stand, and limbs that reach.
#pragma once

#include <vector>

#include "nn/geometry/skeleton.h"

namespace restage {

inline constexpr std::array<int, 2> kFeet = {10, 11};  ///< the balls of the left and right foot

/// Which feet (left, right) stand in every frame of a performance at kFps, joints in the world,
/// noise-free: the foot joint moves less than 0.15 m/s from the frame before and to the one after,
/// and is not 10 cm higher than the lowest place of either within 30 frames around.
std::vector<std::array<bool, 2>> standing_feet(const std::vector<Joints>& performance);

/// Moves the left (side 0) or right foot of a pose by `offset` (metres) as far as the leg reaches:
/// hip and knee turn, the foot keeps its own orientation, the knee its side of the leg.
void move_foot(const Joints& rest, int side, const Vec3& offset, Pose* pose);
/// The same of a hand: shoulder and elbow turn.
void move_hand(const Joints& rest, int side, const Vec3& offset, Pose* pose);
/// Turns the left (side 0) or right arm about the line from shoulder to wrist until its elbow is as
/// near `place` (metres, in the world) as it comes. The hand stays where and as it is. The nearer
/// an arm is to straight, the less it is turned: that would wring its skin and move nothing.
void turn_elbow(const Joints& rest, int side, const Vec3& place, Pose* pose);

}  // namespace restage
