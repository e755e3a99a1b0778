// Sequences of clouds or meshes, frame by frame in constant memory.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "datasets/readers/byte_stream.h"
#include "nn/geometry/body.h"

namespace restage {

struct Frame {
  std::string source;           ///< file, or "file:frame number" (from 0) where it holds several
  Points points;                ///< metres; the number may change from frame to frame
  std::vector<Triangle> faces;  ///< empty for a cloud
  int64_t sequence = 0;         ///< which sequence of an HDF5 file it belongs to
  size_t left_out = 0;          ///< points that were NaN or infinite
};

class FrameSource {
 public:
  virtual ~FrameSource() = default;
  /// The next frame, nothing at the end. InputError for a bad frame (also: no points, NaN).
  virtual std::optional<Frame> next() = 0;
  virtual void skip() { next(); }      ///< leaves one frame out, reading as little as it can
  virtual void rewind() = 0;           ///< next() gives the first frame again
  virtual int64_t frames() const = 0;  ///< how many there are in all
  virtual int64_t sequences() const { return 1; }
  virtual double fps() const = 0;  ///< the file's rate; kFps where nothing says one
};

struct FrameOptions {
  std::string clip;                  ///< of glTF files: the animation to play; empty: the first
  uint64_t max_memory = kMaxMemory;  ///< what unpacking an array may take
  std::optional<int64_t> sequence =
      std::nullopt;  ///< only this one, from 0; else all, one after the other
  /// Of meshes and arrays: points that are NaN or infinite are left out instead of refused.
  bool leave_out_non_finite = false;
};

/// A folder of numbered PLY, OBJ or glTF files (natural numeric order: f2 before f10; other files
/// are left out), one PLY/OBJ file, an HDF5 file of scans or predictions (their vertices), a glTF
/// file (its surface performing an animation at 30 fps, or at rest if it has none), or arrays of
/// points, NPY or NPZ (array_frames.h): one of shape [N, 3] or [F, N, 3], or, without meshes beside
/// them, a folder of [N, 3]. InputError if there is nothing to read, or a clip or sequence is named
/// that is not there.
std::unique_ptr<FrameSource> open_frames(const std::string& path, const FrameOptions& options = {});

/// The files of a folder that are its frames, in order; empty if it has none.
std::vector<std::string> frame_files(const std::string& folder);
/// These files (PLY, OBJ, glTF, arrays [N, 3]) as the frames of one sequence.
std::unique_ptr<FrameSource> open_frame_files(std::vector<std::string> files,
                                              const FrameOptions& options = {});

/// f2 < f10: runs of digits compare as numbers, everything else by character.
bool natural_less(const std::string& a, const std::string& b);

}  // namespace restage
