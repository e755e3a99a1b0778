// The pose of a person's own body, corrected by a cloud: the chain's pose is off by some
// centimetres, and what the skeleton can explain has to be no business of the surface.
#pragma once

#include "infer/track/scan.h"

namespace restage {

struct PoseFitOptions {
  /// Width of the kernel that weights matches, metres, one step after the other.
  std::vector<double> widths = {0.08, 0.06, 0.05, 0.04, 0.03, 0.03, 0.02, 0.02};
  /// Factor of the cost of turning joints away from `start`.
  double stiffness = 0.3;
  /// How many points of a scan would show the whole body. The fewer there are, the less they move;
  /// 0: the scan shows all of it.
  double whole = 0;
};

/// Damped Gauss-Newton steps on all rotations and the place of the pelvis. Each point pulls the
/// nearest vertex of the body's skinned surface along its normal. Joints that no point shows stay
/// as in `start`. `body` must have faces. The same input gives the same bits.
Pose fit_pose(const Body& body, const Scan& scan, const Pose& start,
              const PoseFitOptions& options = {});

/// The vertices in a pose, by linear blend skinning, in double precision.
std::vector<Vec3> skinned(const Body& body, const Pose& pose);

/// The smallest turn as a vector, and back; radians.
Vec3 turn_vector(const Mat3& turn);
Mat3 turn_of(const Vec3& vector);
/// The matrix that gives v x p for p.
Mat3 cross_with(const Vec3& v);

}  // namespace restage
