// What the joints of one person over time show without a truth: what cannot be true of a person.
// `restage assess` prints it (docs/real_scans.md).
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "nn/geometry/skeleton.h"

namespace restage::metrics {

/// Standard deviation over the frames of the length of the bone from each joint's parent to the
/// joint, metres; 0 for the pelvis. A person's bones are of constant length. Empty below two
/// frames.
std::optional<std::array<double, kJoints>> bone_length_spread(std::span<const Joints> frames);

/// Frames in which the legs, or the arms, have changed sides: true for those frames. The joints
/// below hip or shoulder are followed from frame to frame; they have changed sides where the left
/// ones go on nearer to where the right ones were, and the other way round. Which side is right
/// cannot be seen, so the rarer one counts as changed.
std::vector<bool> side_changes(std::span<const Joints> frames);

/// Of each frame, the mean distance of its joints from a parabola through the seven frames around
/// it (Savitzky and Golay 1964), metres; 0 for the first and last three. Empty below seven frames.
std::vector<double> jitter(std::span<const Joints> frames);

/// How far the lowest points of a person who stands are from one floor, metres: the floor is the
/// fifth percentile of the frames' lowest points, and those within 0.1 m of it stand. The median.
/// Empty below two frames.
std::optional<double> floor_spread(std::vector<double> lowest);

}  // namespace restage::metrics
