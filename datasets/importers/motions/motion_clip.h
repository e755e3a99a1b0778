// From the frames of a foreign skeleton to a motion of the 22 joints at 30 fps: what BVH and
// ASF/AMC files share.
#pragma once

#include <string>
#include <vector>

#include "datasets/importers/motions/rest_pose.h"
#include "datasets/importers/report.h"
#include "nn/geometry/body.h"

namespace restage {

struct MotionOptions {
  /// Metres per unit of the file. 0: by the rest pose's leg (hip-knee-ankle), which is 0.4 to 1.4 m
  /// of a person: legs of [0.4, 1.4) are metres, [4, 10) decimetres, [10, 20) inches / 0.45 (the
  /// CMU set), [20, 50) inches, [50, 140) centimetres, [400, 1400) millimetres; else InputError.
  /// An ASF file that says its units is believed.
  double scale = 0.0;
  RestOptions rest;
  /// True frames per second where the file's frame time is wrong. 0: the file's, and a frame time
  /// within 0.05 % of a whole number of frames per second means that number; AMC files say none and
  /// are 120 fps.
  double fps = 0.0;
  /// Frames of the file to leave out at its beginning. -1: those that the profile knows its files
  /// to begin with (Profile::lead), if this one does; else none.
  int drop_leading = -1;
  /// Frames of the file to keep after those; 0: all.
  size_t keep_frames = 0;
  /// A faster root, metres per second between two frames, means a broken file. 0: any speed.
  double max_root_speed = 25.0;
  /// Take a recording whose left and right are exchanged, with a remark; else InputError.
  bool force = false;
  bool fingers = false;  ///< read them, too
  /// Bone names: a built-in profile's name or a YAML file (profiles.h); empty: the one that fits.
  std::string profile;
  std::string layout;  ///< of joints without rotations (joints/layouts.h); empty: the one that fits
  /// Empty id: the file's name. Empty subject: from the file's name (07_01 -> 07), else the id.
  std::string id, subject, split = "train", action;
};

struct MotionClip {
  Motion motion;
  std::vector<FingerTurns> fingers;  ///< per frame; empty: not asked for, or the source has none
  std::vector<Joints> joints;        ///< the source's own 22 joints per frame, world, metres, y up
  double rest_y = 0;                 ///< height of the pelvis where the file's zero pose has it
  double floor_y = 0;                ///< height of the clip's floor in that world
  double scale = 0;                  ///< metres per unit of the file
  ImportReport report;
};

/// Joints below the hips that have position channels (which replace their OFFSET).
struct BonePositions {
  size_t joints = 0;
  double off_offset = 0;  ///< the most that they differ from OFFSET, file units
  double stray = 0;       ///< the most that one moves from its mean place, and which
  std::string stray_joint;
};

/// How a file's recording came to be a SourceMotion.
struct Recording {
  SourceMotion motion;  ///< in the file's units, at the file's rate
  NamedJoints names;
  std::string format;          ///< "BVH", "AMC": for the report
  std::string rate_of_file;    ///< "the file says 120 fps": for the report
  bool rate_known = true;      ///< false: not by the file, but by custom
  double metres_per_unit = 0;  ///< if the file says it
  uint64_t bytes = 0;          ///< of the file, unpacked
  BonePositions positions;
  std::vector<std::string> remarks;  ///< of the reader
};

/// Units, axes, rest pose, rate: found or as given, each with a fact in the report. Quarter turns
/// of the whole world make the person of a T-like rest pose face +z. InputError: a rest pose that
/// is not T-like and cannot be made so, unknown units, a jumping root, too long a recording.
MotionClip make_clip(Recording recording, const std::string& path, const MotionOptions& options);

/// The profile that the options ask for; none if they ask for none.
std::optional<Profile> asked_profile(const MotionOptions& options);
/// "a/07_01.bvh.xz" -> "07_01".
std::string stem_of(const std::string& path);

}  // namespace restage
