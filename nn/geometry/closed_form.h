// References that need no learning, shown beside the model in every table (docs/method.md):
// what a rest pose, the source's own skeleton, and a closed form of retargeting achieve.
#pragma once

#include <optional>
#include <vector>

#include "nn/geometry/skeleton.h"

namespace restage {

/// Global rotations that take `rest` joints onto `posed` ones as far as joints show them: at the
/// pelvis the frame of (right hip -> left hip, pelvis -> spine1), at spine3 the frame of (right
/// collar -> left collar, spine3 -> neck), elsewhere the parent's rotation followed by the shortest
/// arc of the bone to the only child; leaves take their parent's rotation. Twist stays unknown.
/// Directions of zero length leave the parent's rotation as it is.
Rotations closed_form_rotations(const Joints& rest, const Joints& posed);

/// What measured rotations of the joints (from the T-pose, global) say beyond their positions.
struct TwistReading {
  std::array<double, kJoints> twist{};  ///< about each posed bone, radians; 0 at frames and leaves
  Rotations beyond;  ///< what is left of each joint's rotation then, in its own axes; of a leaf all
                     ///< of it, from its parent's
};
/// The closed form, twisted joint by joint as measured.
TwistReading read_twist(const Joints& rest, const Joints& posed, const Rotations& measured);

/// How much larger B's steps are than A's: ratio of leg lengths (spec 3.3). 1 if A has no legs.
double trajectory_scale(const Joints& source, const Joints& target_rest);

/// B performing A's motion in closed form: local rotations and the pelvis at A's pelvis scaled by
/// trajectory_scale() of the first frame, floor at y = 0. `source` holds A's joints per frame in
/// the world, `target_rest` B's rest joints. Rotations are measured from A's own rest joints where
/// they are known (better), else from B's.
std::vector<Pose> closed_form(const std::vector<Joints>& source, const Joints& target_rest,
                              const std::optional<Joints>& source_rest = std::nullopt);

/// B in its rest pose, carried along the path that closed_form() gives its pelvis.
std::vector<Joints> rest_pose_joints(const std::vector<Joints>& source, const Joints& target_rest);
// The third reference, "source skeleton unchanged", is `source` itself.

}  // namespace restage
