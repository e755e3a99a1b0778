// Whether somebody stands in T-pose.
#pragma once

#include <array>
#include <optional>

#include "nn/geometry/body.h"

namespace restage {

struct TPoseAngles {
  std::array<double, 2> arms;   ///< left and right arm from +x and -x, degrees
  std::array<double, 2> below;  ///< of that, below the horizontal; negative: raised
  double turned = 0;            ///< both arms, about the vertical: as if the body faced elsewhere
  double legs = 0;              ///< the leg farther from straight down, degrees
};

/// Of named joints, y up, facing +z.
TPoseAngles t_pose_angles(const Joints& joints);
/// Of points with y up, facing +z, in any unit. Nothing if there are no arms at the sides at all.
std::optional<TPoseAngles> t_pose_angles(const Points& points);

}  // namespace restage
