// Sinkhorn's steps of optimal transport (3D-CoreNet, Song et al. 2021, section 3.2).
#pragma once

#include "autograd/tape/tape.h"

namespace restage {

/// The plan a K b' of Sinkhorn's steps with uniform margins, [n, v, p]: from a = 1 / v in every
/// step b = (1 / p) / (K' a + epsilon), then a = (1 / v) / (K b + epsilon).
///
/// The gradient of K through all steps is a sum of outer products, two for each step. The op makes
/// them in one matrix product, so that the large gradient is written once.
struct Sinkhorn {
  static constexpr const char* name = "sinkhorn";
  static constexpr const char* letters = "K[n, v, p]";
  int steps = 5;
  double epsilon = 1e-8;  ///< added to sums before they divide
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

inline Var sinkhorn(const Var& kernel, int steps = 5, double epsilon = 1e-8) {
  return call(Sinkhorn{steps, epsilon}, {kernel});
}

}  // namespace restage
