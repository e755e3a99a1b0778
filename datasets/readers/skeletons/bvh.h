// The BVH file format: a hierarchy and a table of channel values, as written in the file.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "datasets/readers/skeletons/skeleton_file.h"

namespace restage {

struct BvhFile {
  SourceSkeleton skeleton;                     ///< file units; the root keeps its OFFSET
  std::vector<std::vector<Channel>> channels;  ///< per joint, in the file's order
  std::vector<size_t> first_channel;           ///< per joint
  size_t channel_count = 0;
  double frame_time = 0;                    ///< seconds
  double frame_time_digit = 0;              ///< what one of its last printed digit is worth
  std::vector<std::vector<double>> frames;  ///< channel_count values each; degrees, file units
  size_t lines_left_out = 0;  ///< after as many frames as the file announces: vendors miscount
};

/// Parses the text of a BVH file; `path` is for messages. Any joint order, any channel order.
/// InputError with file:line for anything that is not BVH, not finite, or of fewer frames than it
/// announces; lines after these are left out. A frame time may have a decimal comma; one
/// that is none (0, say) is refused unless the rate is told otherwise.
BvhFile parse_bvh(std::string_view text, const std::string& path, bool rate_is_told = false);

}  // namespace restage
