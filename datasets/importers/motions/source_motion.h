// Motions of foreign skeletons (BVH, ASF/AMC, CMU) and their mapping by joint names onto the 22.
// Units: metres, y up, once scaled; rotations are relative to the source's own zero pose.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "autograd/base/error.h"
#include "datasets/importers/report.h"
#include "datasets/importers/rigs/finger_bones.h"
#include "datasets/importers/rigs/profiles.h"
#include "datasets/readers/skeletons/skeleton_file.h"
#include "nn/geometry/body.h"

namespace restage {

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

struct NamedJoints {
  JointMap map;
  /// Built in, the one asked for, or one without a name: found by structure. Never null.
  const Profile* profile = nullptr;
  /// The bone called pelvis. map[0] turns with the bone that carries both legs, which may hang on
  /// it.
  int hips = -1;
  std::vector<int> placed;  ///< joints that the source lacks, put where the profile says
};

/// A skeleton that name_joints() does not know: which joints it did not find.
struct UnknownSkeleton : InputError {
  UnknownSkeleton(const std::string& where, const std::string& wrong, const std::string& fix)
      : InputError(where, wrong, fix), reason(wrong) {}
  std::string reason;  ///< the error's text without file and remedy
};

/// Finds the 22 joints: with `profile` by its names, else with the built-in profile whose names are
/// there and hang together, else by parts of names and structure (profiles/README.md). Case
/// and what all names are decorated with ("mixamorig:", "_01") do not matter. UnknownSkeleton for
/// one that is not found; InputError for two characters, for bones that the profile names and the
/// file lacks, and for names in another encoding than UTF-8.
NamedJoints name_joints(const SourceSkeleton& skeleton, const std::string& where,
                        const Profile* profile = nullptr);
/// InputError if there are two characters in it: name_joints() without a profile says so, too.
void check_one_person(const SourceSkeleton& skeleton, const std::string& where);
/// Positions of all its joints at zero rotations, relative to the root.
std::vector<Vec3> zero_positions(const SourceSkeleton& skeleton);
/// Positions of the 22 joints at zero rotations, relative to the pelvis.
Joints rest_joints(const SourceSkeleton& skeleton, const JointMap& map);

/// A slow frame rate, or joints that never move, make a long motion of a few bytes: InputError if
/// these frames, as they are or at 30 fps, are far more than a file of `bytes` can mean (in memory:
/// beyond 64 MB and 8 times the file).
void check_length(size_t frames, size_t joints, double fps, uint64_t bytes,
                  const std::string& path);

/// Slerp of local rotations and linear interpolation of translations at t = k / 30 s.
SourceMotion resample(const SourceMotion& motion);

/// Global rotations and positions of the 22 joints in one frame.
PosedSkeleton source_pose(const SourceMotion& motion, const JointMap& map, size_t frame);
/// World rotations of fingers in one frame, from the zero pose.
FingerTurns source_fingers(const SourceMotion& motion, const FingerBones& bones, size_t frame);

/// Frame by frame; in pieces, as the frames of hours are many.
using Poses = std::deque<PosedSkeleton>;

/// 5th percentile over frames of the lowest ankle or foot: the height of the clip's floor.
double floor_height(const Poses& poses);
/// The same from lowest_foot() of each frame.
double floor_height(std::vector<double> lowest);
double lowest_foot(const PosedSkeleton& pose);

/// World rotations and hips over the floor, in a motion named so. The frames must be at 30 fps
/// already.
Motion to_motion(const Poses& poses, const Joints& rest, double floor_y, Motion named = {});

}  // namespace restage
