// What is learnt of somebody from positions of joints before the poses are solved. Internal to this
// folder.
#pragma once

#include "datasets/importers/joints/believed.h"

namespace restage::joints_detail {

struct LearntBody {
  CleanJoints joints;
  Believed believed;  ///< of each frame of `joints`
  Joints rest;        ///< find_skeleton()
  double noise = 0;   ///< of a joint's place, metres
};
/// Facts and remarks go into the report. InputError as clean_joints() says.
LearntBody learn_body(const JointRecording& recording, const MotionOptions& options,
                      ImportReport& report);

}  // namespace restage::joints_detail
