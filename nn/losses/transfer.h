// Losses of the systems that pose a mesh without a skeleton: edges, distances between all points.
#pragma once

#include <optional>

#include "nn/models/tst.h"

namespace restage {

/// NPT's edge loss of each item, [n]: the mean over faces of the sum over their three edges of
/// | length / reference length - 1 |. pred and reference [n, v, 3]; faces i32 [m, f, 3], each for
/// n / m items in a row, or [f, 3] for all; a face with a corner twice is none, and counts for
/// nothing. The reference has no gradient. An edge whose reference has no length counts as right;
/// where a predicted edge has none the gradient is zero. ShapeError without faces.
Var edge_loss(const Var& pred, const Tensor& reference, const Tensor& faces);

/// Distances between all points of each item: x [n, v, 3] -> [n, v, v], gradient zero where two
/// points coincide.
Var pair_distances(const Var& x);

/// LART's metric loss (equation 3): mean over all pairs of the squared difference between the
/// distances of `pred` and (1 - alpha) those of `first` + alpha those of `last`, each [n, v, 3].
Var metric_loss(const Var& pred, const Tensor& first, const Tensor& last, double alpha);

/// Which edges have the right length: those of the target's mesh, or those of the true answer.
enum class EdgeReference { identity, truth };

/// Weights of the terms of transfer_loss(); a term of weight 0 is not computed.
struct TransferWeights {
  double reconstruction = 1;  ///< of the mean squared difference of coordinates, always computed
  double edge = 0.0005;       ///< of edge_loss(), mean
  double distances = 0;       ///< of the mean squared difference of distances between points
  double metric = 0;          ///< of metric_loss() of a mixture of two codes; needs a Lart
  double adversarial = 0;     ///< of a discriminator's judgement
  EdgeReference edge_reference = EdgeReference::identity;
  int64_t metric_points = 1024;  ///< points whose distances to each other count
  /// How much of the last frame is in that mixture; without it, drawn from ctx.rng.
  std::optional<double> mixture = {};
};

/// Windows of a performer, the target's mesh and the true answer, on one device but for the faces,
/// which are counted in the host's memory.
struct TransferExamples {
  Tensor pose;      ///< [n, t, p, 3]
  Tensor identity;  ///< [n, v, 3]
  Tensor truth;     ///< [n, t, v, 3]
  Tensor faces;     ///< i32 [m, f, 3] or [f, 3], as edge_loss() wants them
};

/// The loss of a network that poses a mesh, [1]. `made`: what the network answers. `judge`: TST's
/// discriminator, a constant here; null without an adversarial term. Error if a metric term is
/// wanted of a model whose codes cannot be mixed.
Var transfer_loss(Context& ctx, TransferModel& net, const TransferExamples& examples,
                  const TransferWeights& weights, const TstDiscriminator* judge, Tensor* made);

/// All frames of all items below one another: [n, t, v, 3] -> [n t, v, 3].
Var frames_below(const Var& x);

}  // namespace restage
