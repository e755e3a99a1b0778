// Any file that is read or written here as a clip that can be drawn, with its own materials.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "datasets/readers/gltf/gltf_look.h"
#include "experiments/pictures/clips.h"
#include "experiments/pictures/look.h"
#include "infer/render/clip.h"

namespace restage {

/// What of a file is shown.
struct ShowRequest {
  std::string path;
  std::string clip;   ///< of a glTF file; empty: the last that Restage wrote, else the first
  std::string bones;  ///< as MotionOptions::profile
  Look look;          ///< at what the camera looks
  /// Frames per second; nothing: the file's, and 30 of a glTF animation, which has no frames.
  std::optional<double> fps;
  int64_t every = 1;  ///< frames: one in so many
  /// One frame only: this one, or the one at this time, else the middle one.
  bool single = false;
  std::optional<int64_t> frame;
  std::optional<double> seconds;
  std::optional<int64_t> sequence;  ///< of an HDF5 file; nothing: the only one
  std::string up;                   ///< of scans and recordings: the axis that points up; empty: y
  std::optional<double> scale;      ///< of scans and recordings: metres per unit; nothing: 1
  std::optional<double>
      file_fps;  ///< of scans: the rate that they were taken at; nothing: the file's
  uint64_t max_memory = 0;
};

struct Showing {
  /// In metres, y up; characters whose bones are known face +z at rest. What is far from a
  /// person's size is drawn at a person's. `focus` is set where a part is looked at.
  Clip clip;
  std::string animation;  ///< its name; empty: none
  double close_up = 0;    ///< FilmOptions::close_up
  double facing = 0;      ///< of one frame: degrees that the person is turned from +z to +x
  Remarks remarks;
};

/// What a glTF file looks like, moved out of `look`. Null: it has neither materials nor colours,
/// and is drawn as surfaces of other files are.
std::shared_ptr<const Appearance> appearance_of(GltfLook& look);

/// InputError: the readers' own; a clip, frame or time that is not there; nothing to draw; a part
/// to look at of a file whose joints are not known.
Showing read_showing(const ShowRequest& request);

}  // namespace restage
