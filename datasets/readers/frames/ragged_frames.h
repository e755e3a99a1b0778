// Sequences of clouds of unequal size that are kept as one array of points, one frame behind the
// other, beside whole numbers that say where each frame begins or how many points it has.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace restage {

/// An array beside the points.
struct BesideArray {
  std::string name;
  std::vector<int64_t> shape;
  bool whole_type = false;  ///< of a type of whole numbers
  std::function<std::vector<double>()> read;
};

struct RaggedFrames {
  std::string name;             ///< of the array that tells the frames
  std::vector<int64_t> offset;  ///< frame f has the points [offset[f], offset[f + 1])
};

/// Whether an array of this name says how many points or frames there are.
bool names_lengths(const std::string& name);

/// How the frames of `points` points lie, if an array beside them tells it: lengths whose sum is
/// the number of points (lengths, num_points, counts ...), offsets that begin with 0 and grow to
/// that number or to the last frame's start (frame_offset, splits, ptr, starts ...), ends, or a
/// frame for each point (frame_id, batch). An array of another name counts if its numbers fit
/// exactly. Nothing if no array is of this kind. InputError naming `file` and the array if one is
/// named so and does not fit: then it is unknown which points are of one frame.
std::optional<RaggedFrames> ragged_frames(const std::string& file, int64_t points,
                                          const std::vector<BesideArray>& beside);

}  // namespace restage
