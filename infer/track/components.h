// A take's offsets as few morph targets with a weight in each frame.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "infer/writers/distances.h"
#include "nn/geometry/body.h"

namespace restage {

struct SurfaceComponents {
  Points mean;  ///< of all frames, metres: belongs to the mesh at rest
  /// Three numbers a vertex, from -127 to 127: metres times 127 for a weight of 1.
  std::vector<std::vector<int8_t>> deltas;
  /// Of all components in the first frame, then in the second, ...; whole multiples of 1 / 32767.
  std::vector<float> weights;
  DistanceSummary error;  ///< between offsets and what is stored, at rest; metres
};

/// Calls the function with the offsets of every frame, in order; is called several times.
using OffsetFrames = std::function<void(const std::function<void(const Points&)>&)>;

/// Principal components of the offsets: as few as keep 95 % of all vertices' errors below `error`
/// metres, and no more than `most`, which may be 64. The same input gives the same bits. Memory:
/// some 200 frames, however many there are, and four bytes a component and frame.
SurfaceComponents surface_components(const OffsetFrames& frames, double error, size_t most);

inline constexpr size_t kMostComponents = 64;

}  // namespace restage
