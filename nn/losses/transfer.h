// Losses of the systems that pose a mesh without a skeleton: edges, distances between all points.
#pragma once

#include "autograd/tape/tape.h"

namespace restage {

/// NPT's edge loss of each item, [n]: the mean over faces of the sum over their three edges of
/// | length / reference length - 1 |. pred and reference [n, v, 3]; faces i32 [m, f, 3], each for
/// n / m items in a row, or [f, 3] for all; a face with a
/// corner twice is none. The reference has no gradient. An edge whose reference
/// has no length counts as right; where a predicted edge has none the gradient is zero. ShapeError
/// without faces.
Var edge_loss(const Var& pred, const Tensor& reference, const Tensor& faces);

/// Distances between all points of each item: x [n, v, 3] -> [n, v, v], gradient zero where two
/// points coincide.
Var pair_distances(const Var& x);

/// LART's metric loss (equation 3): mean over all pairs of the squared difference between the
/// distances of `pred` and (1 - alpha) those of `first` + alpha those of `last`, each [n, v, 3].
Var metric_loss(const Var& pred, const Tensor& first, const Tensor& last, double alpha);

/// TST's generator loss on a window of its own vertices [t, v, 3] ("Arc 4, final" of its program).
struct TstLosses {
  Var adversarial;     ///< -log of how real the discriminator finds the frames [t, 1], mean
  Var reconstruction;  ///< squared coordinate differences, summed over everything
  Var edge;            ///< edge_loss against the identity, summed over frames
  Var distances;       ///< squared differences of pair distances over pairs and frames, over the
                       ///< number of pairs
  Var total;           ///< 1, 2, 0.5 and 0.5 times these
};
TstLosses tst_losses(const Var& pred, const Tensor& truth, const Tensor& identity,
                     const Tensor& faces, const Var& real);

}  // namespace restage
