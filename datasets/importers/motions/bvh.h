// BVH files as motions of the 22 joints at 30 fps.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "datasets/importers/motions/motion_clip.h"
#include "datasets/readers/skeletons/bvh.h"

namespace restage {

/// Reads .bvh and .bvh.xz. InputError: not BVH, bones that cannot be named (which), and what
/// make_clip() says.
MotionClip read_bvh(const std::string& path, const MotionOptions& options = {});
/// The same from text; `path` is for messages and the id.
MotionClip convert_bvh(std::string_view text, const std::string& path,
                       const MotionOptions& options = {});

/// Rotations of all joints, translations of those from the root down to each of `moving` (the hips,
/// and what moves beside them), in the file's units. Takes the file's frames as it goes, so that
/// they are in memory only once.
SourceMotion bvh_motion(BvhFile file, const std::vector<int>& moving);

}  // namespace restage
