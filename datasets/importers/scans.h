// Sequences of clouds and meshes as they come from scanners: files, folders of frames, trees of
// such folders (CAPE: subject/sequence/*.npz; 4D-DRESS: subject/outfit/take/.../*.ply).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "datasets/importers/motions/motion_clip.h"
#include "datasets/readers/byte_stream.h"
#include "datasets/readers/frames/frame_folder.h"
#include "datasets/readers/frames/frame_names.h"
#include "datasets/schema.h"

namespace restage {

/// One sequence: a file that holds it, or its frames' files in order.
struct ScanSequence {
  std::string name;
  std::string file;             ///< that holds the sequence; empty: `frames` do
  std::optional<int64_t> part;  ///< which of the sequences of a file
  FrameList frames;
};

/// All sequences in a file or below a folder: each folder of frames (frame_folder.h), each folder
/// of numbered folders with a frame in each (folder_a_frame()), each array that is a sequence, the
/// single clouds among arrays of a folder together, each sequence of an HDF5 file; folders in
/// natural numeric order. What cannot be used is named in `skipped`, pickles (.pkl) as a count.
std::vector<ScanSequence> find_scans(const std::string& path, uint64_t max_memory,
                                     std::vector<std::string>& skipped);

/// Appends a sequence to `out` in metres, y up and at 30 fps, in constant memory. Clouds cannot be
/// interpolated: each frame is the nearest one in time, and the report says how many were left out
/// or repeated. Frames of fewer than 64 different points, and those that cannot be read, are
/// replaced by the nearest ones, up to a second of them. Faces are dropped. Of the options fps (0:
/// the file's, else 30), scale (0: 1) and up axis (automatic: y) count. Returns the number of
/// frames. InputError: see open_frames(); the frames before it are in `out`, until its
/// drop_sequence().
int64_t import_scans(const ScanSequence& sequence, const MotionOptions& options,
                     uint64_t max_memory, ScanWriter& out, ImportReport& report);

/// The same of frames that are open, in metres and y up; `stated`: the rate is the file's own.
int64_t import_frames(FrameSource& source, const std::string& name, const MotionOptions& options,
                      bool stated, ScanWriter& out, ImportReport& report);

}  // namespace restage
