// Feet on the floor. Recorded clips drift: their lowest point hovers centimetres over or under the
// floor. What drifts slowly is taken out; jumps, which are fast, stay.
#pragma once

#include <vector>

#include "nn/geometry/body.h"

namespace restage {

/// Vertices that can touch the floor first: of each joint, those farthest out in 26 directions.
std::vector<int32_t> outermost_vertices(const Body& body);

/// Height of the lowest of `vertices` in every frame of the motion on this body, metres.
std::vector<double> lowest_heights(const Motion& motion, const Body& body,
                                   const std::vector<int32_t>& vertices);

/// A smooth curve on or below `heights`: the lowest value within `half` frames to either side, then
/// its mean over the same width. No value of the result exceeds the height of its frame.
std::vector<double> lower_envelope(const std::vector<double>& heights, size_t half);

/// The motion with its hips moved up and down so that `body` (an average one) touches the floor at
/// least once within `window` seconds about every frame and never sinks into it. `window` 0: as is.
Motion on_floor(const Motion& motion, const Body& body, const std::vector<int32_t>& vertices,
                double window);

}  // namespace restage
