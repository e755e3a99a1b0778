// Sequences of clouds or meshes, frame by frame in constant memory.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

struct Frame {
  std::string source;           ///< file, or "file:frame number" (from 0) for HDF5 and glTF
  Points points;                ///< metres; the number may change from frame to frame
  std::vector<Triangle> faces;  ///< empty for a cloud
  int64_t sequence = 0;         ///< which sequence of an HDF5 file it belongs to
};

class FrameSource {
 public:
  virtual ~FrameSource() = default;
  /// The next frame, nothing at the end. InputError for a bad frame (also: no points, NaN).
  virtual std::optional<Frame> next() = 0;
  virtual void rewind() = 0;           ///< next() gives the first frame again
  virtual int64_t frames() const = 0;  ///< how many there are in all
  virtual double fps() const = 0;      ///< the file's rate; kFps where nothing says one
};

/// A folder of numbered mesh files (natural numeric order: f2 before f10; other files are left
/// out), one PLY/OBJ file, an HDF5 file of scans or predictions (their vertices), or a glTF file:
/// its surface performing the animation `clip` (empty: the first) at 30 fps, or at rest if it has
/// none. InputError if there is nothing to read, or a clip is named where there are none.
std::unique_ptr<FrameSource> open_frames(const std::string& path, const std::string& clip = "");

/// f2 < f10: runs of digits compare as numbers, everything else by character.
bool natural_less(const std::string& a, const std::string& b);

}  // namespace restage
