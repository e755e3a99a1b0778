// Results and scans as something that can be drawn.
#pragma once

#include <string>

#include "experiments/source.h"
#include "infer/render/clip.h"

namespace restage {

/// What is said of a file that was read although something is wrong with it.
using Remarks = std::vector<std::string>;

/// One sequence of a prediction or scan file (HDF5), a folder of PLY/OBJ frames, a single mesh, or
/// what else Source reads. A surface stays one only if all frames have the same faces; a prediction
/// of joints alone becomes a cloud of points along the bones. A frame that cannot be read is
/// replaced by the nearest one before (or after) that can, points that are not finite are left out,
/// and a remark is added. InputError: check_one_sequence(), there is no such sequence, or none of
/// its frames can be read.
Clip read_clip(const SourceRecord& how, const std::string& label, uint64_t max_memory,
               Remarks& remarks);
/// The same of a file that is in our frame. InputError also for what would be a remark.
Clip read_clip(const std::string& path, const std::string& label, int64_t sequence = 0);
/// Whether a file can be given to read_joints().
bool has_joints(const std::string& path);
/// The joints of each of the sequence's frames, metres. InputError: not HDF5, no /joints,
/// check_one_sequence().
std::vector<Joints> read_joints(const std::string& path, const std::optional<int64_t>& sequence);
/// How far each vertex of `result` is from its true place once the frame is aligned (PA-MPVD), as
/// its colours on a page. False, and nothing done, unless both are surfaces of the same vertices
/// and frames.
bool add_errors(const Clip& truth, Clip* result);

}  // namespace restage
