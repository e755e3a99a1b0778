// Neighbourhoods of points (no gradient) and the pooling of vector attention.
#pragma once

#include "autograd/kernels/kernel.h"

namespace restage {

/// query [n, m, 3], points [n, v, 3] -> out i32 [n, m, k]: the k nearest points, nearest first,
/// ties to the lower index (spec 2.2).
struct KnnArgs {
  const Tensor& query;
  const Tensor& points;
  Tensor& out;
};
/// points [n, v, 3] -> out i32 [n, m]: farthest point sampling, started at the point farthest from
/// the centroid, ties to the lower index (spec 2.2).
struct FpsArgs {
  const Tensor& points;
  Tensor& out;
};
/// score, value [p, k, d] -> out [p, d] = sum over k of softmax_k(score * scale) * value;
/// weights [p, k, d] keeps the softmax.
struct AttentionPoolArgs {
  const Tensor& score;
  const Tensor& value;
  Tensor& out;
  Tensor& weights;
  double scale;
};
/// Gradients of score and value (out).
struct AttentionPoolGradArgs {
  const Tensor& value;
  const Tensor& weights;
  const Tensor& y;
  const Tensor& gy;
  Tensor& g_score;
  Tensor& out;
  double scale;
};

}  // namespace restage
