// Optimal transport between two point sets (3D-CoreNet, Song et al. 2021, section 3.2).
#pragma once

#include "autograd/tape/tape.h"

namespace restage {

struct TransportOptions {
  int steps = 5;
  double temperature = 0.03;
  double epsilon = 1e-8;  ///< added to sums before they divide
};

/// The plan a K b' of Sinkhorn's steps with uniform margins, [n, v, p], for similarities [n, v, p]
/// in -1 to 1. K = exp(-(1 - similarity) / temperature) >= e^-67, which float32 holds: no
/// logarithms are needed. Gradients go through all steps.
Var transport_plan(const Var& similarity, const TransportOptions& options = {});
/// The plan with rows that add up to 1.
Var transport_rows(const Var& plan);

}  // namespace restage
