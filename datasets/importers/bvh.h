// BVH files as motions of the 22 joints at 30 fps.
#pragma once

#include <string>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

enum class UpAxis { automatic, y, z };

struct BvhOptions {
  /// Metres per unit of the file. 0: by the rest pose's leg (hip-knee-ankle), which is 0.4 to 1.4 m
  /// of a person: legs of [0.4, 1.4) are metres, [4, 10) decimetres, [10, 20) inches / 0.45 (the
  /// CMU set), [20, 50) inches, [50, 140) centimetres, [400, 1400) millimetres; else InputError.
  double scale = 0.0;
  /// automatic: the axis along which the head is furthest from the ankles in the rest pose.
  UpAxis up = UpAxis::automatic;
  /// True frames per second where the file's frame time is wrong. 0: the file's, and a frame time
  /// within 0.05 % of a whole number of frames per second means that number.
  double fps = 0.0;
  /// Frames of the file to leave out at its beginning. -1: 11 if frame 0 is a T-pose (every joint
  /// within 30 degrees of zero) and frame 11 is not (some joint beyond 45), else 0: in the Daz
  /// release of the CMU set frame 0 is a T-pose and up to 8 frames blend out of it.
  int drop_leading = -1;
  /// Frames of the file to keep after those; 0: all.
  size_t keep_frames = 0;
  /// A frame to take as the rest pose (a T-pose) where zero rotations are none; -1: zero rotations.
  int rest_frame = -1;
  /// A faster root, metres per second between two frames, means a broken file. 0: any speed.
  double max_root_speed = 25.0;
  std::string subject, split = "train",
                       action;  ///< empty subject: from the file name (07_01 -> 07)
};

struct BvhClip {
  Motion motion;
  std::vector<Joints> joints;  ///< the source's own 22 joints per frame, world, metres, y up
  double floor_y = 0;          ///< height of the clip's floor in that world
  double scale = 0;            ///< metres per unit of the file
};

/// Reads .bvh and .bvh.xz. The rest pose is turned, with the whole world and by quarter turns, so
/// that the person faces +z (exactly, if `rest_frame` is given). InputError: not BVH, joints that
/// cannot be mapped (which), a rest pose that is not T-like, unknown units, a jumping root.
BvhClip read_bvh(const std::string& path, const BvhOptions& options = {});
Motion import_bvh(const std::string& path, const BvhOptions& options = {});
/// The same from text; `path` is for messages and the id.
BvhClip convert_bvh(std::string_view text, const std::string& path, const BvhOptions& options = {});

}  // namespace restage
