// Vector attention over neighbours (spec 2.2), with the products over pairs of points folded:
//   h_ij = relu(W r_ij + b), r_ij = x_i - x_j;  [s_ij, t_ij] = M h_ij
//   e_ij = G relu(query_i - key_j + s_ij);      y_i = sum_j softmax_j(scale e_ij) (value_j + t_ij)
// The softmax is over the neighbours j of i, for every channel by itself.
#pragma once

#include "autograd/kernels/kernel.h"
#include "autograd/kernels/matmul_precision.h"

namespace restage {

/// The inputs, which both the forward and the backward pass read.
struct NeighbourAttentionInputs {
  const Tensor& xyz;    ///< [n, v, 3]
  const Tensor& index;  ///< i32 [n, v, k], neighbours of each point, within its cloud
  const Tensor& query;  ///< [n, v, d]
  const Tensor& key;    ///< [n, v, d]
  const Tensor& value;  ///< [n, v, d]
  const Tensor& w;      ///< W [d, 3]
  const Tensor& b;      ///< [d]
  const Tensor& both;   ///< M [2d, d]: first the rows that give s, then those that give t
  const Tensor& gamma;  ///< G [d, d]
  double scale;
  /// Do every product in full, instead of leaving out hidden units whose ReLU has the same sign for
  /// all pairs of a tile of neighbouring points. The result is the same up to rounding.
  bool dense = false;
  /// Precision of the products over pairs on a GPU. The CPU makes these products in float32, inside
  /// of loops.
  MatmulPrecision precision = MatmulPrecision::float32;
};

/// out [n, v, d]; weights [n, v, k, d] keeps the softmax for the backward pass (null if there will
/// be none).
struct NeighbourAttentionArgs {
  NeighbourAttentionInputs in;
  Tensor& out;
  Tensor* weights;
};

/// Gradients of the inputs; g_xyz is null where none is wanted.
struct NeighbourAttentionGradArgs {
  NeighbourAttentionInputs in;
  const Tensor& weights;
  const Tensor& y;
  const Tensor& gy;
  Tensor* g_xyz;
  Tensor& g_query;
  Tensor& g_key;
  Tensor& g_value;
  Tensor& g_w;
  Tensor& g_b;
  Tensor& g_both;
  Tensor& out;  ///< gradient of gamma
};

}  // namespace restage
