// The rest pose of a recording: which way is up, which way it faces, and the T-pose that rotations
// are counted from. Shared by all importers of moving skeletons.
#pragma once

#include <string>

#include "datasets/importers/motions/axis.h"
#include "datasets/importers/motions/source_motion.h"
#include "datasets/importers/report.h"

namespace restage {

struct RestOptions {
  /// automatic: where the head is from the ankles in the rest pose; if that pose does not stand,
  /// on average over the recording.
  Axis up = Axis::automatic;
  /// Which way the rest pose faces. automatic: by its left and right joints, to the nearest quarter
  /// turn if that is less than 10 degrees away.
  Axis facing = Axis::automatic;
  /// A frame of the recording that is a T-pose; -1: zero rotations.
  int frame = -1;
};

/// A pose of a person facing +z with +x its left, y up, and how poses of the file are told in its
/// terms: world rotation = align * (rotation in the file) * frame[j].
struct RestPose {
  Joints joints;    ///< metres, the pelvis at 0
  Rotations frame;  ///< from the T-pose to the joint's axes at zero rotations
  Mat3 align;       ///< from the file's axes to ours
};

/// A thigh, shin, upper arm or forearm of a T-pose and where it points.
struct Limb {
  int from, to;
  Vec3 wanted;
};
const std::vector<Limb>& t_pose_limbs();

/// A rest pose whose left and right are exchanged makes a mirror image of every motion: InputError
/// in the doctor's words, or a remark if it is forced. `rest` in our frame.
void check_handedness(const Joints& rest, bool force, ImportReport& report);

/// The zero pose (or the frame asked for), turned with the whole world so that the person stands
/// upright and faces +z. A zero pose with a limb more than 120 degrees off a T-pose's (LAFAN1, some
/// SOMA files: all bones along one axis) cannot be corrected bone by bone, so a T-pose is built:
///
/// 1. the trunk, as it lies in the zero pose, upright, the line of the hips along x;
/// 2. limb by limb from the trunk outwards, collars and arms along +-x, legs down, feet forward and
///    level as when they stand: the bone's mean direction in the recording is turned by the
///    shortest arc (not the zero pose's, whose arcs of 180 degrees leave the twist open);
/// 3. thighs and upper arms are then twisted about their own axis so that, on average, knees bend
///    backwards and elbows forwards.
///
/// `motion` in metres. Adds facts and remarks, with the angle of every limb that is off the T-pose.
/// InputError: the frame asked for is no T-pose, nothing tells up from down, no T-pose can be
/// built.
RestPose find_rest_pose(const SourceMotion& motion, const JointMap& map, const RestOptions& options,
                        ImportReport& report);

}  // namespace restage
