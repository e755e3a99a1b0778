// Skinning weights of the built-in bodies.
#pragma once

#include "datasets/builtin/body_shape.h"
#include "datasets/builtin/surface_nets.h"

namespace restage {

using Weights = Eigen::Matrix<float, Eigen::Dynamic, kJoints, Eigen::RowMajor>;

/// Weights of a body in units of its height: soft steps along each chain of the skeleton, gated so
/// that nothing reaches the other leg or from an arm to the trunk, then smoothed over the surface.
/// At most 4 joints per row, rows sum to 1.
Weights shape_weights(const BodyShape& shape, const SurfaceMesh& mesh);

}  // namespace restage
