// Joints of the closed form, to compare with.
#pragma once

#include "nn/geometry/closed_form.h"

namespace restage {

/// B's joints performing closed_form().
inline std::vector<Joints> closed_form_joints(const std::vector<Joints>& source,
                                              const Joints& target_rest) {
  std::vector<Joints> joints;
  for (const Pose& pose : closed_form(source, target_rest))
    joints.push_back(forward_kinematics(target_rest, pose).joints);
  return joints;
}

}  // namespace restage
