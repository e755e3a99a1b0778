// A take's offsets as few morph targets with a weight in each frame.
#pragma once

#include <cstdint>
#include <vector>

#include "infer/writers/distances.h"
#include "nn/geometry/body.h"

namespace restage {

struct SurfaceComponents {
  Points mean;  ///< of all frames, metres: belongs to the mesh at rest
  /// Three numbers a vertex, from -127 to 127: metres times 127 for a weight of 1.
  std::vector<std::vector<int8_t>> deltas;
  std::vector<float> weights;  ///< of all components in the first frame, then in the second, ...
  DistanceSummary error;       ///< between offsets and what is stored, at rest; metres
};

/// Principal components of the offsets, one frame each: as few as keep 95 % of all vertices' errors
/// below `error` metres, and no more than `most`. Each component is rounded to bytes before the
/// next one is looked for, so the next ones mend what rounding lost. The same input gives the same
/// bits. Memory: the offsets, which are used up.
SurfaceComponents surface_components(std::vector<Points> offsets, double error, size_t most);

}  // namespace restage
