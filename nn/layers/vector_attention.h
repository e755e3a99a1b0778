// The point transformer's blocks (spec 2.2).
#pragma once

#include "nn/layers/mlp.h"
#include "nn/layers/norm.h"

namespace restage {

/// Vector attention over the k nearest neighbours; c channels in and out, d inside.
struct VectorAttention : Module {
  VectorAttention(int64_t c, int64_t d, int64_t k, const Init& init);
  /// xyz [n, v, 3], f [n, v, c] -> [n, v, c]. Who is a neighbour of whom has no gradient; the
  /// offsets between neighbours have one.
  Var operator()(Context& ctx, const Var& xyz, const Var& f) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "VectorAttention"; }
  Linear fc1, fc2;
  ReluChain fc_delta, fc_gamma;
  Linear w_qs, w_ks, w_vs;
  /// For measurements: computes products over pairs in full, also where many pairs would allow to
  /// leave some out. The result is the same up to rounding.
  bool dense = false;

 private:
  /// The weighted sum over neighbours: as the paper writes it, and for many pairs with folded
  /// weights.
  Var plain(Context& ctx, const Var& xyz, const Var& f, const Tensor& index) const;
  Var folded(Context& ctx, const Var& xyz, const Var& f, const Tensor& index) const;

  int64_t d_, k_;
};

/// Set abstraction: m farthest points, the k nearest of each, two point convolutions with batch
/// norm and ReLU, maximum over the neighbours.
struct SetAbstraction : Module {
  SetAbstraction(int64_t m, int64_t k, int64_t in, int64_t out, const Init& init);
  /// xyz [n, v, 3], f [n, v, c]; xyz becomes [n, m, 3].
  Var operator()(Context& ctx, Var* xyz, const Var& f);
  void visit(Fields& f) override;
  const char* kind() const override { return "SetAbstraction"; }
  ModuleList<Linear> mlp_convs;
  ModuleList<BatchNormLayer> mlp_bns;

 private:
  int64_t m_, k_;
};

/// Offsets of neighbours: points [n, v, 3] by index [n, m, k] minus their centre [n, m, 3],
/// [n, m, k, 3].
Var neighbour_offsets(const Var& points, const Var& centres, const Tensor& index);

}  // namespace restage
