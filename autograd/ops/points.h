// Neighbourhoods of point clouds and the pooling step of vector attention (spec 2.2).
#pragma once

#include "autograd/tape/tape.h"

namespace restage {

/// Indices (i32) [n, m, min(k, v)] of the nearest of points [n, v, 3] to each of query [n, m, 3],
/// nearest first, ties to the lower index. No gradient.
Tensor knn(const Tensor& query, const Tensor& points, int64_t k);
/// Farthest point sampling: indices (i32) [n, m] into points [n, v, 3]. ShapeError if m > v: a
/// point would be chosen twice. No gradient.
Tensor fps(const Tensor& points, int64_t m);

/// y [p, d] = sum over k of softmax_k(score * scale) * value, per channel; score, value [p, k, d].
struct AttentionPool {
  static constexpr const char* name = "attention_pool";
  static constexpr const char* letters = "score[p, k, d], value[p, k, d], k > 0";
  double scale = 1;  ///< positive
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

inline Var attention_pool(const Var& score, const Var& value, double scale) {
  return call(AttentionPool{scale}, {score, value});
}

}  // namespace restage
