// The point transformer's vector attention over neighbours, all its products over pairs in one op
// (spec 2.2; kernels/attention.h has the equations).
#pragma once

#include "autograd/kernels/matmul_precision.h"
#include "autograd/tape/tape.h"

namespace restage {

/// y [n, v, d]; with r_ij = x_i - x_j, h = relu(W r + b), [s, t] = M h over the neighbours j of i:
/// y_i = sum_j softmax_j(scale (G relu(query_i - key_j + s_ij) + g)) (value_j + t_ij), per channel.
/// g is the same for all neighbours, so the softmax does not see it: its gradient is zero.
struct NeighbourAttention {
  static constexpr const char* name = "neighbour_attention";
  static constexpr const char* letters =
      "xyz[n, v, 3], query[n, v, d], key[n, v, d], value[n, v, d], W[d, 3], b[d], M[2d, d], G[d, "
      "d], "
      "g[d]";
  Tensor index;        ///< i32 [n, v, k], k > 0: neighbours of each point within its cloud
  double scale = 1;    ///< positive
  bool dense = false;  ///< do every product in full (kernels/attention.h)
  MatmulPrecision precision = matmul_precision();  ///< of a GPU's products (kernels/attention.h)
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

/// inputs: xyz, query, key, value, W, b, M, G, g.
inline Var neighbour_attention(std::initializer_list<Var> inputs, const Tensor& index, double scale,
                               bool dense = false) {
  return call(NeighbourAttention{index, scale, dense}, inputs);
}

}  // namespace restage
