// Clouds as depth cameras see people, cheap enough to draw one for every training sample: points of
// the surface are kept or left out, where scanner.h casts rays. (What is learned from these is
// validated on those: evaluation_scans.)
#pragma once

#include "autograd/base/rng.h"
#include "nn/geometry/body.h"

namespace restage {

/// Who looks at a training cloud.
enum class Sensor {
  none,        ///< points are drawn by area, all around
  one_camera,  ///< one depth camera
  ring         ///< three to seven cameras around
};

struct Watch {
  Sensor sensor = Sensor::none;
  bool ceiling = false;  ///< cameras stand 40 to 90 degrees above the person, not -15 to 40
};

/// How many surface points to draw for `n` that a sensor sees.
size_t candidates(Sensor sensor, size_t n);

/// At most `n` of the surface points, as likely to be there as a camera's pixels would hit them:
/// hidden points are gone, surfaces seen flat are sparse. Some clouds lose a hole, or what is near
/// the floor; some points lie too far along their ray, or anywhere. At least 64 points, if there
/// are as many. Where the cameras stand is a function of `cameras`. `normals`: of length one, out
/// of the surface. `which`: numbers of the points.
Points sensed(const Watch& watch, const Points& points, const Points& normals, size_t n,
              const RngKey& cameras, const RngKey& key, std::vector<size_t>* which);

}  // namespace restage
