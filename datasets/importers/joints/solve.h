// From positions of joints to a motion. Where bones point is in the positions, exactly; how they
// are turned about themselves is what the network of turn_net.h believes.
#pragma once

#include "datasets/importers/joints/joint_file.h"
#include "datasets/importers/motions/skeleton_take.h"

namespace restage {

struct SolvedJoints {
  Motion motion;  ///< at 30 fps
  /// How far each joint's turn is believed to be off, radians, mean over the frames. Shoulders'
  /// and elbows' errors are nearly all about the bone itself.
  std::array<double, kJoints> expected_error{};
};

/// `options`: up, scale, fps, force, and the names of the motion. The rest pose is a T-pose with
/// this person's bones; where all of them are known and keep their length, the motion's joints are
/// the file's. Facts and remarks go into the report. InputError as clean_joints() says.
SolvedJoints solve_joints(const JointRecording& recording, const MotionOptions& options,
                          ImportReport& report);

}  // namespace restage
