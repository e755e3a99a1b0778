// What H4D's codes stand for, computed from data: a linear body in the place of SMPL, and a basis
// of changes of pose (spec 9.3).
#pragma once

#include "datasets/corpus.h"
#include "nn/models/h4d.h"

namespace restage {

/// InputError unless all bodies have the faces of `like`, so that their vertices correspond.
void require_topology(const std::vector<Body>& bodies, const Body& like);

/// The mean of the bodies at rest, and the first `most` directions in which they differ, or as many
/// as there are. A direction is as long as its standard deviation, so shapes have about the
/// deviation 1, as SMPL's. Joints are linear in the shape, with the least squared error. Skin
/// weights are the bodies' mean. float32, metres. InputError: fewer than two bodies, bodies of
/// different faces, or bodies that are all the same.
LinearBody fit_linear_body(const std::vector<Body>& bodies, int64_t most);

/// The shape [b] that comes nearest to a body with these vertices at rest: the projection of its
/// vertices on the directions. `mean` [v, 3] and `directions` [v, 3, b] of a LinearBody, on the
/// host.
std::vector<float> nearest_shape(const Tensor& mean, const Tensor& directions,
                                 const Points& vertices);

/// `angle_axis`, or the same rotation by whole turns more or less, whichever is nearest to
/// `before`: so rotation vectors of a motion do not jump at a half turn.
Vec3 without_jump(const Vec3& angle_axis, const Vec3& before);

/// The first `root` and `joints` components of the changes of pose against frame 0, each or as many
/// as there are, at least one. `poses` [n, t, 3 j]: axis-angle, without jumps. float32.
/// InputError where nothing of either moves.
MotionBasis fit_motion_basis(const Tensor& poses, int64_t root, int64_t joints);

}  // namespace restage
