// Clouds in NPY and NPZ arrays, as cloud_axes.h says which shapes are.
//
// An NPZ may hold other things too. Its cloud is the array that is named so (points, vertices,
// verts, v_posed, which is CAPE's name of a posed frame, xyz, cloud and the like; case does not
// matter); without such a name, the only array that has the shape of a cloud, which no array is
// that is known to be something else (normals, colours, joints, the parameters of a body model). A
// number `fps` beside it is the sequence's frame rate. Whole numbers beside it may part one array
// of points into frames of unequal size (ragged_frames.h). Flat rows [F, 3 V] are frames where
// faces or a template beside them say how many vertices there are.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "datasets/readers/arrays/npz.h"
#include "datasets/readers/clouds/cloud_axes.h"
#include "datasets/readers/frames/frame_folder.h"

namespace restage {

/// Whether the name ends in .npy or .npz, in any case.
bool is_array_name(const std::string& path);
bool is_npz_name(const std::string& path);

struct CloudArray {
  std::string name;  ///< empty for an NPY file
  CloudAxes axes;
  /// Where the frames of a sequence begin that lie one behind the other in one cloud, and their end
  /// (ragged_frames.h); empty for others.
  std::vector<int64_t> offset;
};

/// The cloud that is named so; nothing if there is none.
std::optional<CloudArray> named_cloud(const Npz& file);
/// The cloud of an NPZ; nothing if it has none. InputError if there are several to choose from, or
/// it is a motion of a body model.
std::optional<CloudArray> find_cloud(const Npz& file);
/// The same of an NPY or NPZ file.
std::optional<CloudArray> find_cloud(const std::string& path, uint64_t max_memory = kMaxMemory);

/// Whether the cloud is a body as a pose estimator saw it: vertices beside the numbers of a camera
/// (SAM 3D Body, 4DHumans, ROMP). Its y points down.
bool is_seen_by_camera(const std::string& path, uint64_t max_memory = kMaxMemory);

/// The frame rate that an array file states, if it does.
std::optional<double> stated_fps(const std::string& path, uint64_t max_memory = kMaxMemory);

/// One frame or a sequence, frame by frame in constant memory (all at once where a frame is spread
/// over the whole file: Fortran order, frames last). Points that are NaN or infinite are left out.
/// InputError: no cloud, no points at all, see npz.h.
std::unique_ptr<FrameSource> open_array_frames(const std::string& path,
                                               const FrameOptions& options = {});

/// The single frame of a file; InputError if it holds a sequence.
Frame read_array_frame(const std::string& path, const FrameOptions& options = {});

}  // namespace restage
