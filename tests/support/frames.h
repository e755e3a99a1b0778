// The frames of a system, all that a call shows.
#pragma once

#include <string>
#include <vector>

#include "infer/retargeter.h"

namespace restage {

/// All frames that `call(show)` shows.
template <class Call>
std::vector<RetargetedFrame> shown_by(const Call& call) {
  std::vector<RetargetedFrame> out;
  call([&](const RetargetedFrame& frame) { out.push_back(frame); });
  return out;
}

inline std::vector<RetargetedFrame> pushed(System& system, const Points& cloud,
                                           const std::string& source) {
  return shown_by([&](const System::Show& show) { system.push(cloud, source, show); });
}

inline std::vector<RetargetedFrame> pushed_joints(Retargeter& system, const SeenJoints& seen) {
  return shown_by([&](const System::Show& show) { system.push_joints(seen, show); });
}

inline std::vector<RetargetedFrame> finished(System& system) {
  return shown_by([&](const System::Show& show) { system.finish(show); });
}

}  // namespace restage
