#include "infer/footing.h"

#include <algorithm>
#include <cmath>

#include "nn/geometry/contact.h"

namespace restage {
namespace {

constexpr double kStands = 0.5;    // a foot with a greater chance stands
constexpr double kSettling = 0.2;  // seconds
constexpr double kLetDown = 0.5;   // of a lift is left in the next frame

// In units of the leg, hip to ankle: how far a foot that is on the floor may be from standing flat,
// and one that is elsewhere has to be.
constexpr double kOnFloor = 0.075, kElsewhere = 0.15;

}  // namespace

FlatFoot bare_foot(const Joints& a) {
  constexpr double kAnkle = 0.089, kBall = 0.012;
  const double leg = leg_length(a);
  return {kAnkle * leg, kBall * leg};
}

FlatFoot flat_foot(const Joints& rest) {
  return {0.5 * (rest[7].y() + rest[8].y()), 0.5 * (rest[10].y() + rest[11].y())};
}

namespace {

/// How high A's feet are over where they stand flat.
std::array<double, 2> clear_of_floor(const Joints& a, const FlatFoot& flat) {
  std::array<double, 2> out;
  for (size_t side = 0; side < 2; ++side)
    out[side] =
        std::min(a[7 + side].y() - flat.ankle, a[static_cast<size_t>(kFeet[side])].y() - flat.ball);
  return out;
}

/// 0 for a foot on the floor, 1 for one elsewhere. `clear`: metres over or under the floor.
double elsewhere(double clear, double leg) {
  const double t = std::clamp(
      (std::abs(clear) / std::max(leg, 1e-6) - kOnFloor) / (kElsewhere - kOnFloor), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

}  // namespace

std::array<double, 2> sole_heights(const Joints& a, const FlatFoot& flat, double scale) {
  std::array<double, 2> out = clear_of_floor(a, flat);
  for (double& clear : out) clear = elsewhere(clear, leg_length(a)) * scale * clear;
  return out;
}

std::array<double, 2> least_heights(const Joints& a, const FlatFoot& flat, double scale) {
  std::array<double, 2> out = sole_heights(a, flat, scale);
  for (double& height : out) height = std::min(height, 0.0);
  return out;
}

std::array<double, 2> floating(const Joints& a, const FlatFoot& flat, double scale,
                               const Soles& soles, const Joints& rest, const Pose& pose) {
  std::array<double, 2> out = soles.lowest(forward_kinematics(rest, pose));
  const std::array<double, 2> clear = clear_of_floor(a, flat);
  for (size_t side = 0; side < 2; ++side) {
    const double meant = scale * std::max(clear[side], 0.0);
    out[side] = (1 - elsewhere(clear[side], leg_length(a))) * std::max(0.0, out[side] - meant);
  }
  return out;
}

std::array<double, 2> Footing::operator()(const Joints& rest, const Joints& a, double scale,
                                          const std::array<double, 2>& standing, Pose* pose) {
  pose->root.y() += raised_.value_or(0);
  const std::array<double, 2> wanted = sole_heights(a, bare_foot(a), scale),
                              lowest = soles_.lowest(forward_kinematics(rest, *pose));
  std::array<double, 2> above{lowest[0] - wanted[0], lowest[1] - wanted[1]};
  double sum = 0, weights = 0;
  for (size_t side = 0; side < 2; ++side)
    if (standing[side] > kStands) {
      sum += standing[side] * above[side];
      weights += standing[side];
    }
  double by = 0;
  if (weights > 0)
    by = sum / weights;
  else if (!raised_)  // in the air, or nothing is known of it
    by = above[wanted[0] < wanted[1] ? 0 : 1];
  if (raised_) by *= 1 - std::exp(-1 / (kFps * kSettling));
  raised_ = raised_.value_or(0) - by;
  pose->root.y() -= by;
  for (double& height : above) height -= by;
  return above;
}

void Footing::settle_feet(const Joints& rest, const Joints& a, double scale, Pose* pose) {
  const std::array<double, 2> deep =
      depths(least_heights(a, bare_foot(a), scale), soles_, rest, *pose);
  const std::array<double, 2> high = floating(a, bare_foot(a), scale, soles_, rest, *pose);
  for (size_t side = 0; side < 2; ++side) {
    const double wanted = deep[side] > 0 ? deep[side] : -high[side];
    lifts_[side] = std::max(wanted, lifts_[side] + (1 - kLetDown) * (wanted - lifts_[side]));
  }
  raise_feet(lifts_, rest, pose);
}

}  // namespace restage
