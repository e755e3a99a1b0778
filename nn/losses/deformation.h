// The loss of deformation (spec 5.2, 5.3).
#pragma once

#include "nn/losses/measure.h"
#include "nn/models/deformation.h"

namespace restage {

/// Points of one batch; shapes [n, v, 3], [n, 22, 3], [n, 22, 3, 3], [n, 66]; all relative to the
/// pelvis.
struct DeformationBatch {
  Tensor rest_points, posed_points, rest_joints, local, axis_angle;
  /// What the networks read in the place of rest_points and rest_joints; undefined: those.
  Tensor seen_points = {}, seen_joints = {};
};

struct DeformationOutput {
  Var weights, offsets, posed;  ///< [n, v, 22], [n, v, 3] (undefined without offsets), [n, v, 3]
};

/// Eq. 3: posed points from rest points. `offsets` may be null.
DeformationOutput deform(Context& ctx, const DeformationModel& weights, const OffsetNet* offsets,
                         const DeformationBatch& batch);
/// The same, with gradients for those arguments that are on a tape.
DeformationOutput deform(Context& ctx, const DeformationModel& weights, const OffsetNet* offsets,
                         const Var& rest_points, const Var& rest_joints, const Var& local,
                         const Var& axis_angle);
/// Cross-entropy of weights [n, v, 22] against the weights of the data, summed over points and
/// pairs.
Var skin_cross_entropy(const Var& weights, const Tensor& truth);
/// Squared distances (v2, eq. 4) or distances (v1), summed over all points and pairs.
Var distance_sum(const Var& posed, const Var& truth, Measure measure = Measure::mse);
/// Mean distance per point, metres (a number to report, not to differentiate).
double mean_distance(const Tensor& a, const Tensor& b);

}  // namespace restage
