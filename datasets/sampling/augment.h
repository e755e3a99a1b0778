// Heading and mirror image of a sample. A mirrored sample is the mirror image of everything: the
// body (its joints change sides), the pose and the path, so kinematics hold for it exactly.
#pragma once

#include "autograd/base/rng.h"
#include "nn/geometry/body.h"

namespace restage {

struct Augmentation {
  double heading = 0;   ///< turn about y through the world's origin, radians; comes first
  bool mirror = false;  ///< x -> -x; comes second
};

/// Which augmentations are wanted; `heading_range` is the largest turn to either side, radians.
Augmentation draw_augmentation(Rng& rng, double heading_range, bool mirror);

Vec3 augmented(const Augmentation& a, const Vec3& x);
void augment(const Augmentation& a, Points& points);
/// Posed joints: turned, mirrored, and each side under the other's name.
Joints augmented(const Augmentation& a, const Joints& posed);
/// Rest joints: mirrored only, since headings belong to poses.
Joints augmented_rest(const Augmentation& a, const Joints& rest);
Pose augmented(const Augmentation& a, const Pose& pose);
/// Every joint's rotation in the world.
Rotations augmented(const Augmentation& a, const Rotations& global);

}  // namespace restage
