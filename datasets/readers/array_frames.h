// Clouds in NPY and NPZ arrays.
//
// An NPZ may hold other things too. Its cloud is the array named points, vertices, verts or v_posed
// (CAPE's name for a posed frame; it includes the translation), in this order; without one of these
// names, the only array of floating-point numbers shaped [N, 3] or [F, N, 3]. A number `fps` beside
// it is the sequence's frame rate.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "datasets/readers/frame_folder.h"
#include "datasets/readers/npz.h"

namespace restage {

/// Whether the name ends in .npy or .npz, in any case.
bool is_array_name(const std::string& path);
bool is_npz_name(const std::string& path);

struct CloudArray {
  std::string name;       ///< empty for an NPY file
  bool sequence = false;  ///< [F, N, 3] rather than [N, 3]
};

/// The cloud of an NPZ; nothing if it has none. InputError if there are several to choose from, or
/// it is a motion of AMASS.
std::optional<CloudArray> find_cloud(const Npz& file);
/// The same of an NPY or NPZ file.
std::optional<CloudArray> find_cloud(const std::string& path, uint64_t max_memory = kMaxMemory);

/// The frame rate that an array file states, if it does.
std::optional<double> stated_fps(const std::string& path, uint64_t max_memory = kMaxMemory);

/// One frame [N, 3] or a sequence [F, N, 3], frame by frame in constant memory (in Fortran order:
/// all at once, as one frame is then spread over the whole file). InputError: no cloud, no points,
/// NaN, see npz.h.
std::unique_ptr<FrameSource> open_array_frames(const std::string& path,
                                               const FrameOptions& options = {});

/// The single frame of a file; InputError if it holds a sequence.
Frame read_array_frame(const std::string& path, const FrameOptions& options = {});

}  // namespace restage
