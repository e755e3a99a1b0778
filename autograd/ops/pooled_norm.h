// The last layer of a PointNet trunk: a 1x1 convolution, batch norm and the maximum over points.
#pragma once

#include "autograd/kernels/pooled_norm.h"
#include "autograd/ops/norm.h"

namespace restage {

/// y [n, o] = max over v of act(batch_norm(x W^T + b)), with the batch's own statistics (training
/// mode); the gradient of a maximum goes to the first point that attains it. Exact, and cheaper
/// than its parts: the gradient has one point per channel and cloud, and batch norm spreads it only
/// along an affine function of x, so the backward pass needs products of i x i matrices instead of
/// [n v, i] x [i, o] ones. The bias has no gradient: batch norm takes it away.
struct PooledNorm {
  static constexpr const char* name = "pooled_norm";
  static constexpr const char* letters = "x[n, v, i], W[o, i], b[o], scale[o], shift[o], v > 0";
  Activation activation = Activation::none;
  double eps = 1e-5;
  BatchStatistics* statistics = nullptr;  ///< of x W^T + b; filled by forward if not null
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

inline Var pooled_norm(const Var& x, const Var& weight, const Var& bias, const Var& scale,
                       const Var& shift, Activation activation = Activation::none,
                       double eps = 1e-5, BatchStatistics* statistics = nullptr) {
  return call(PooledNorm{activation, eps, statistics}, {x, weight, bias, scale, shift});
}

}  // namespace restage
