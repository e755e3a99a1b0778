// Somebody else's limb in a picture: what a segmentation leaves of a second person, or a hand that
// reaches in.
#pragma once

#include <span>

#include "autograd/base/rng.h"
#include "datasets/sampling/surface.h"

namespace restage {

/// Uniformly random.
Mat3 any_rotation(Rng& rng);

/// How much of a point's skin weights is of what hangs on a joint.
float hangs_on(int joint, std::span<const float, kJoints> weights);
/// What hangs on one joint of a body, as in its rest pose.
Mesh limb_of(const Body& body, int joint);

/// Which limb of which body, and where: turned any way about its middle, which is 0.3 to 0.9 m
/// beside somebody's middle and up to 0.6 m above or below it.
struct Intruder {
  size_t body = 0;
  int joint = 0;
  Mat3 turn = Mat3::Identity();
  Vec3 place = Vec3::Zero();
};
Intruder draw_intruder(Rng& rng, size_t bodies);
/// Puts points of its body where it is beside somebody whose middle is `middle`.
void put_intruder(const Intruder& intruder, const Vec3& middle, Points& limb);

}  // namespace restage
