// Points that cannot belong to the person in a cloud: a sensor's far away mistakes.
#pragma once

#include "nn/geometry/body.h"

namespace restage {

/// How far, metres, a point may be from the middle (the median) of its cloud along an axis.
inline constexpr float kStrayDistance = 5;

/// The most strays: one point in so many. In a cloud that is not in metres far more points are that
/// far from the middle: half of a person in decimetres, nearly all in smaller units.
inline constexpr size_t kStrayShare = 5;

/// The points of a cloud (finite, metres) that are not strays, if at most one in kStrayShare is
/// one, or a single one. More are no mistakes of a sensor: then, and where there are none, `kept`
/// is left alone. Returns how many strays were left out.
size_t leave_out_strays(const Points& cloud, Points* kept);

}  // namespace restage
