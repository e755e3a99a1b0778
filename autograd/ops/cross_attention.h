// Attention of queries over keys, in blocks: no matrix of queries by keys is ever held in full.
#pragma once

#include "autograd/kernels/matmul_precision.h"
#include "autograd/tape/tape.h"

namespace restage {

/// y [n, t, c]: y_i = sum_j softmax_j(factor q_i . k_j) v_j (Vaswani et al. 2017, with a factor of
/// 1 / sqrt(d); AniFormer and LART take 1). Queries and keys may differ in number. Memory grows
/// with t + m and not with t m: scores of a block of queries are computed, used, and computed again
/// for the gradient. Made of the products and softmax that every device has, so it needs no kernel
/// of its own; blocks are cut by sizes alone.
struct CrossAttention {
  static constexpr const char* name = "cross_attention";
  static constexpr const char* letters = "q[n, t, d], k[n, m, d], v[n, m, c], m > 0";
  double factor = 1;
  /// Scores that are held at once, or those of one query: on the host they stay in the caches, on a
  /// GPU they keep it busy.
  static constexpr int64_t kOnHost = 1 << 21, kOnGpu = 1 << 25;
  int64_t most_scores = kOnHost;
  MatmulPrecision precision = matmul_precision();  ///< see LinearOp
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

inline Var cross_attention(const Var& q, const Var& k, const Var& v, double factor = 1) {
  const bool host = q.value.device() == Device{};
  return call(CrossAttention{factor, host ? CrossAttention::kOnHost : CrossAttention::kOnGpu},
              {q, k, v});
}

}  // namespace restage
