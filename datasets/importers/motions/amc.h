// AMC recordings on their ASF skeletons as motions of the 22 joints at 30 fps.
#pragma once

#include <string>
#include <string_view>

#include "datasets/importers/motions/motion_clip.h"
#include "datasets/readers/skeletons/asf.h"

namespace restage {

inline constexpr double kAmcFps = 120;  ///< of the CMU set; the files do not say

/// Reads .amc and .asf, either may end in .xz; `asf` empty: find_asf(). The subject, if none is
/// given, is the skeleton's name (07.asf -> 07). InputError as the readers and make_clip() say.
MotionClip read_amc(const std::string& path, const std::string& asf = "",
                    const MotionOptions& options = {});
/// The same from texts; the paths are for messages and the id.
MotionClip convert_amc(std::string_view amc, const std::string& path, std::string_view asf,
                       const std::string& asf_path, const MotionOptions& options = {});

/// Rotations of all bones and the root's translation, in the file's units. Takes the frames as it
/// goes.
SourceMotion amc_motion(const AsfFile& asf, AmcFile amc);

/// The skeleton beside a recording: of the .asf files of its folder the one with the longest name
/// that the recording's begins with (07_01.amc: 07.asf), else the only one. InputError: none.
std::string find_asf(const std::string& amc_path);

}  // namespace restage
