// Attention of a target's points over a pose's (AniFormer, LART).
#pragma once

#include "nn/layers/linear.h"

namespace restage {

/// rest + gamma sum_j softmax_j(q_i . k_j) v_j: queries from `target` [n, v, c], keys and values
/// from `pose` [n f, m, c], residual [n f, v, c]; f frames share a target. Where all keys are equal
/// they may be given as one (m = 1), and so may the residual: the answer is one row, too, which all
/// queries would get. gamma starts at 0.
struct GatedCrossAttention : Module {
  GatedCrossAttention(int64_t channels, const Init& init);
  Var operator()(Context& ctx, const Var& target, const Var& pose, const Var& residual) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "CrossAttention"; }
  Linear q, k, v;
  Parameter gamma;
};

}  // namespace restage
