// Motions of foreign skeletons (BVH, CMU) and their mapping by joint names onto the 22 joints.
// Units: metres, y up, once scaled; rotations are relative to the source's own zero pose.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

struct SourceSkeleton {
  std::vector<std::string> names;
  std::vector<int> parents;   ///< a parent comes before its children; -1: root
  std::vector<Vec3> offsets;  ///< from the parent, zero pose
  std::vector<Vec3> ends;     ///< end site, from the joint; zero if it has none
  std::vector<uint8_t> has_end;
  size_t size() const { return names.size(); }
};

/// Frames of a skeleton. Translations are absent for all joints but the first ones down to the
/// hips.
struct SourceMotion {
  SourceSkeleton skeleton;
  double fps = kFps;
  std::vector<std::vector<Quat>> local;  ///< per frame, one per joint
  std::vector<int> moving;               ///< joints that have translations; [0] is the root
  std::vector<std::vector<Vec3>>
      position;  ///< per frame, one per moving joint: replaces its offset
};

/// One of the 22 joints in the source: the point `offset` in the frame of `joint`, turning with it.
struct SourceJoint {
  int joint = -1;
  Vec3 offset = Vec3::Zero();
};
using JointMap = std::array<SourceJoint, kJoints>;

/// Finds the 22 joints by name. Known: Daz (cgspeed CMU release), ASF/AMC, CMU original BVH, Mixamo
/// and alike (any namespace prefix), MakeHuman (Root/UpLeg_L, default rig, game engine),
/// SMPL-style. Missing spine and neck joints are put between their neighbours, missing collars and
/// toes at the chest and the end site of the foot. InputError naming `where` and what is missing if
/// no names fit.
JointMap map_joints(const SourceSkeleton& skeleton, const std::string& where);

/// Positions of the 22 joints at zero rotations, relative to the pelvis.
Joints rest_joints(const SourceSkeleton& skeleton, const JointMap& map);

/// Slerp of local rotations and linear interpolation of translations at t = k / 30 s.
SourceMotion resample(const SourceMotion& motion, double fps = kFps);

/// Global rotations and positions of the 22 joints in one frame.
PosedSkeleton source_pose(const SourceMotion& motion, const JointMap& map, size_t frame);

/// 5th percentile over frames of the lowest ankle or foot: the height of the clip's floor.
double floor_height(const std::vector<PosedSkeleton>& poses);
/// The same from lowest_foot() of each frame.
double floor_height(std::vector<double> lowest);
double lowest_foot(const PosedSkeleton& pose);

/// World rotations and hips over the floor. The frames must be at 30 fps already.
Motion to_motion(const std::vector<PosedSkeleton>& poses, const Joints& rest, double floor_y);

}  // namespace restage
