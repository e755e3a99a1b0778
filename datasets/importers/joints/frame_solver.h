// One frame: the pose of a skeleton that goes through positions of joints. Internal to this folder.
#pragma once

#include "datasets/importers/joints/layouts.h"

namespace restage::joints_detail {

/// The pose of a skeleton `rest` that goes through the joints of one frame, of which the trunk is
/// known. `believed`: world turns, of which those stay that the joints leave open. `noise`: of a
/// joint's place, metres.
Pose pose_through(const Joints& rest, const MappedFrame& seen, const Rotations& believed,
                  double noise);

}  // namespace restage::joints_detail
