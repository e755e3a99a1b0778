// What clouds lack besides what a sensor leaves out: a desk hides the legs, the picture's edge an
// arm, a lidar has few points. And how people are turned who do not stand.
#pragma once

#include <vector>

#include "autograd/base/rng.h"
#include "nn/geometry/body.h"

namespace restage {

/// Fewer different points than this make no cloud (nn/models/extraction.h).
inline constexpr size_t kLeastPoints = 64;

/// A plane that hides whatever lies before it.
struct Cut {
  Point towards = Point::UnitY();  ///< of length one; what lies far this way stays
  double share = 0;                ///< of the cloud's extent along it that is hidden
};

/// Three of five are desks: all below something between shins and chest is hidden, and in one of
/// three of these everything below the hips. The others hide up to 40 % from any direction.
Cut draw_cut(Rng& rng);
/// Leaves out of `points` and `which`, which is as long, what does not lie `edge` or more along
/// `towards`; but at least kLeastPoints stay, or nothing is left out.
void keep_beyond(const Point& towards, float edge, Points& points, std::vector<size_t>& which);
/// Leaves what is hidden out of `points` and `which`, which is as long; but at least kLeastPoints
/// stay, or nothing is cut.
void cut_away(const Cut& cut, Points& points, std::vector<size_t>& which);

/// Keeps the first points, as many as a sparse sensor has: kLeastPoints to `most`, all sizes alike
/// on a logarithmic scale. The points have to be in random order.
void thin_out(Rng& rng, size_t most, Points& points, std::vector<size_t>& which);

/// A turn about an axis along the floor, three of four by about 20 degrees, the others by any
/// angle.
Mat3 draw_tilt(Rng& rng);

}  // namespace restage
