#include "infer/render/stand.h"

#include <algorithm>
#include <cmath>

#include "infer/render/clip.h"
#include "infer/render/style.h"

namespace restage {

float before_target(const Camera& camera, const Points& points, bool surface) {
  const float ca = std::cos(camera.azimuth), sa = std::sin(camera.azimuth);
  const float ce = std::cos(camera.elevation), se = std::sin(camera.elevation);
  const Point eye(sa * ce, se, ca * ce);
  const Point centre = clip_centre(points);
  const ClipReach reach = clip_reach(points, centre.y());
  const float most = std::hypot(reach.aside, reach.high);
  float out = 0;
  for (const Point& p : points)
    if (p.allFinite() && (surface || (p - centre).norm() < most))
      out = std::max(out, (p - camera.target).dot(eye));
  return out;
}

void stand_outside(Camera& camera, float tall, float before) {
  constexpr float kAway =
      1.5f;  // what is nearest to the camera is seen at most three times as large
  const float usual = 0.5f * tall / std::tan(0.5f * kView);
  camera.distance = std::max(usual, kAway * before);
  camera.view = camera.distance > usual ? 2 * std::atan(0.5f * tall / camera.distance) : kView;
}

}  // namespace restage
