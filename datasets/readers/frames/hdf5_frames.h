// Frames of HDF5 files: our scans and predictions, and the clouds of others.
#pragma once

#include <memory>
#include <string>

#include "datasets/readers/frames/frame_folder.h"

namespace restage {

/// Whether the name ends in .h5, .hdf5, .hdf or .he5, in any case, or the file of another name
/// (.mat of MATLAB 7.3) is HDF5 by its first bytes. All commands go by this.
bool is_hdf5(const std::string& path);

/// Whether the clouds of a file are not laid out as ours (datasets/README.md).
bool is_foreign_hdf5(const std::string& path);

/// Whether such a file has something of the shape of a cloud.
bool holds_clouds(const std::string& path);

/// Whether a file says its frame rate.
bool states_fps(const std::string& path);

/// Our files: /points with /frame_offset, else /vertices [F, V, 3]. Of others every data set that
/// has the shape of a sequence (cloud_axes.h; a data set `faces` says how many vertices there are)
/// is a sequence, as Dynamic FAUST has them, [V, 3, F]; of single clouds those whose names or
/// groups are a series of numbers are the frames of one. Where some are named as clouds are
/// (cloud_names.h) those with the surest name count, and a remark names the others. Points that are
/// NaN or infinite are left out, but not of surfaces. InputError: no clouds, several that are no
/// series, a sequence that is not there.
std::unique_ptr<FrameSource> open_hdf5_frames(const std::string& path, const FrameOptions& options);

/// InputError unless there is such a sequence, counted from 0.
void check_sequence(const std::string& path, int64_t sequence, int64_t sequences);

}  // namespace restage
