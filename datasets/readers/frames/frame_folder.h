// Sequences of clouds or meshes, frame by frame in constant memory.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "autograd/base/error.h"
#include "datasets/readers/byte_stream.h"
#include "datasets/readers/frames/frame_names.h"
#include "nn/geometry/body.h"

namespace restage {

struct Frame {
  std::string source;           ///< file, or "file:frame number" (from 0) where it holds several
  Points points;                ///< metres; the number may change from frame to frame, and be 0
  std::vector<Triangle> faces;  ///< empty for a cloud
  int64_t sequence = 0;         ///< which sequence of an HDF5 file it belongs to
  size_t left_out = 0;          ///< points that were NaN or infinite
  int64_t number = -1;          ///< by its file's name (FrameList::numbers); -1: none
  int64_t missing = 0;          ///< frames without a point just before it (without_empty_frames())
  /// Why its file could not be read; it has no points then.
  std::optional<InputError> fault = std::nullopt;
};

class FrameSource {
 public:
  virtual ~FrameSource() = default;
  /// The next frame, nothing at the end. Points that are NaN or infinite are left out and counted;
  /// a frame that shows nothing has no points, and so has a file of several that cannot be read
  /// (Frame::fault). InputError where nothing behind a bad frame can be read.
  virtual std::optional<Frame> next() = 0;
  virtual void skip() { next(); }      ///< leaves one frame out, reading as little as it can
  virtual void rewind() = 0;           ///< next() gives the first frame again
  virtual int64_t frames() const = 0;  ///< how many there are in all
  virtual int64_t sequences() const { return 1; }
  virtual std::vector<int64_t> numbers() const { return {}; }  ///< FrameList::numbers of them
  virtual double fps() const = 0;  ///< the file's rate; kFps where nothing says one
  /// What the user should know of the whole: files that were left out, how axes were taken.
  virtual std::vector<std::string> remarks() const { return {}; }
};

struct FrameOptions {
  std::string clip;                  ///< of glTF files: the animation to play; empty: the first
  uint64_t max_memory = kMaxMemory;  ///< what unpacking an array may take
  std::optional<int64_t> sequence =
      std::nullopt;  ///< only this one, from 0; else all, one after the other
  /// Taken off all coordinates before they become floats (far_origin()).
  Vec3 origin = Vec3::Zero();
  bool far = false;  ///< frames that single precision blurs are no error
};

/// A folder of numbered files of one frame each (PLY, OBJ, PCD, tables of points, glTF, arrays; in
/// the order and with the choice of order_frames()), or of numbered folders with one such file in
/// each; one such file; an HDF5 file (hdf5_frames.h); a glTF file (its surface performing an
/// animation at 30 fps, or at rest if it has none); arrays of points, NPY or NPZ (array_frames.h).
/// Of a frame that is there as several kinds of files one is taken. InputError if there is nothing
/// to read, or a clip or sequence is named that is not there.
std::unique_ptr<FrameSource> open_frames(const std::string& path, const FrameOptions& options = {});

/// Where frames lie that single precision would blur (precision.h): a point of the first one that
/// has some. Zero for others.
Vec3 far_origin(const std::string& path, const FrameOptions& options = {});

/// All files of a folder that could be frames, in natural order.
std::vector<std::string> frame_files(const std::string& folder);
/// The files of a folder that are its frames; none if it has none. InputError as order_frames(),
/// and where many of them are pointers of Git LFS.
FrameList frame_list(const std::string& folder);
/// The frames of a folder of numbered folders that hold one frame each: of several files that which
/// all of them hold, with a remark. A folder without a frame is a frame without points: its path,
/// with a slash at the end, stands for the file. None for other folders. InputError as
/// frame_list(); if all of them hold several files that may be the frame, or clouds of several
/// cameras; if one holds another file in its place.
FrameList folder_a_frame(const std::string& folder);
/// frame_list(), if these are a series; else folder_a_frame(), if there is one; else frame_list().
FrameList frames_in(const std::string& folder);
/// Says why a folder has no frames.
[[noreturn]] void throw_no_frames(const std::string& folder);
/// These files as the frames of one sequence.
std::unique_ptr<FrameSource> open_frame_list(FrameList list, const FrameOptions& options = {});

/// "2 frames could not be read ...", with their names and reasons.
std::string remark_on_faults(const std::vector<InputError>& faults);

/// The same frames but for those that show nothing, which are counted in the next one's `missing`;
/// those that could not be read are named in a remark. frames() still counts all. InputError, the
/// first one's, if no frame could be read.
std::unique_ptr<FrameSource> without_empty_frames(std::unique_ptr<FrameSource> all);

}  // namespace restage
