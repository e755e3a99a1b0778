// Frames of unequal size that were filled up to one number of points.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "datasets/readers/frames/ragged_frames.h"
#include "nn/geometry/body.h"

namespace restage {

/// Which points of frames are none. By an array beside them that says how many points each has
/// (lengths, num_points, points_num ...; a number for each frame, each step or each sequence), else
/// by a mask of 0 and 1 (mask, valid, pad ...; 1 for each point that is one, or, where the name or
/// the zeros say so, that is none), else points that are exactly zero at the end of a frame.
class FramePadding {
 public:
  FramePadding() = default;
  /// Of `sequences` sequences of `steps` frames of `points` points each.
  FramePadding(int64_t sequences, int64_t steps, int64_t points,
               const std::vector<BesideArray>& beside);

  /// Leaves out of the frame what is none of its points.
  void cut(int64_t frame, Points& points);
  /// Counts anew what is left out.
  void restart() { left_out_ = frames_cut_ = 0; }
  /// What was left out since then; empty: nothing.
  std::string remark() const;

 private:
  bool take_counts(const BesideArray& array);
  bool take_mask(const BesideArray& array);
  void cut_by_mask(int64_t frame, Points& points);
  void cut_zeros(Points& points);

  int64_t sequences_ = 1, steps_ = 1, points_ = 0;
  std::vector<int64_t> counts_;  ///< of each frame; empty: nothing says it
  std::vector<uint8_t> mask_;    ///< of each point of each frame; empty: there is none
  bool masks_padding_ = false, mask_is_sure_ = false;
  std::string name_;  ///< of the array that says it
  int64_t left_out_ = 0, frames_cut_ = 0;
};

}  // namespace restage
