// The few numbers that are kept of each frame of a sequence; internal to this folder.
#pragma once

#include <array>
#include <cstdint>

#include "datasets/readers/frames/frame_folder.h"

namespace restage::doctor_detail {

inline constexpr int kExtents = 13;  // directions in which a frame's extent is kept

/// What is kept of a frame: where it ends in 26 directions, and its middle.
struct Summary {
  uint64_t content = 0;  ///< the same for the same points in any order
  float size = 0;        ///< median distance from the middle, of all points or of the person's
  std::array<float, 2 * kExtents> extent{};
  Point middle = Point::Zero();
  int64_t sequence = 0, number = -1, missing = 0;  ///< Frame::sequence and so on
};

/// `points`: the frame's, each once.
Summary summary_of(const Frame& frame, const Points& points);
/// How far the outline moved, in the data's units.
double step(const Summary& a, const Summary& b);

}  // namespace restage::doctor_detail
