// CMU clips as they are packed in a data folder (cmu/clips30.h5, cmu_more/clips30_more.h5) as
// motions.
#pragma once

#include <string>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

/// The acknowledgement that CMU asks for; it goes with every file that holds these motions.
inline constexpr const char* kCmuAcknowledgement =
    "The data used in this project was obtained from mocap.cs.cmu.edu. The database was created "
    "with "
    "funding from NSF EIA-0196217.";

struct CmuClip {
  Motion motion;
  std::vector<Joints> joints;  ///< the source's 22 joints per frame, world, metres (before floor_y)
};

/// All clips of `file` (clips30.h5), in its order; `with_joints` also gives the source's joints.
/// InputError: missing, damaged or of another layout.
std::vector<CmuClip> read_cmu(const std::string& file, bool with_joints = false);
std::vector<Motion> import_cmu(const std::string& file);
/// The same without the clips that `without` names: by their name, or by a part of their attribute
/// `source`, which says whose copy of the recordings a clip was made from ("maxxgx" or
/// "motion-graphs" of "maxxgx/motion-graphs", or all of it). Puts into `left_out`, if it is given,
/// how many each of them named. InputError for one that names no clip.
std::vector<Motion> import_cmu(const std::string& file, const std::vector<std::string>& without,
                               std::vector<size_t>* left_out = nullptr);

/// Whether a file holds clips in this layout.
bool is_packed_clips(const std::string& file);

}  // namespace restage
