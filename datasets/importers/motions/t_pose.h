// Builds a T-pose for skeletons whose zero pose is none (find_rest_pose() says how).
#pragma once

#include <string>

#include "datasets/importers/motions/source_motion.h"

namespace restage {

/// Rotation of each joint from its axes at zero rotations (file axes) to the T-pose in our axes.
/// `align` takes the file's axes to ours (y up). InputError if the recording never shows a limb
/// near enough to its place.
Rotations build_t_pose(const SourceMotion& motion, const JointMap& map, const Mat3& align,
                       const std::string& path);

}  // namespace restage
