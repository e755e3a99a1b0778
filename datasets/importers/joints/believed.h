// What the network of turn_net.h believes of how bones are turned. Internal to this folder and to
// bench/joints.
#pragma once

#include "datasets/importers/joints/clean.h"

namespace restage::joints_detail {

struct Believed {
  std::vector<Rotations> turns;         ///< world, per frame
  std::array<double, kJoints> error{};  ///< radians, mean over the frames
};
/// Of every frame, by those before and after it; averaged over a tenth of a second.
Believed believed_turns(const CleanJoints& joints);

/// The same of one moment: the frame with its neighbours as fill_input() takes them.
struct BelievedNow {
  Rotations turns;                      ///< world
  std::array<double, kJoints> error{};  ///< radians
};
BelievedNow believed_now(const std::array<const SeenFrame*, kMoments.size()>& around);

}  // namespace restage::joints_detail
