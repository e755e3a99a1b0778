// `skeleton/point_transformer`: the extractor of the 3DV paper (Table 6; spec 2.2, 2.3).
#pragma once

#include "nn/config/rules.h"
#include "nn/layers/vector_attention.h"
#include "nn/models/skeleton.h"

namespace restage {

struct PointTransformerConfig {
  int64_t points = 1024, blocks = 4, neighbours = 16, width = 512, base = 32, head1 = 256,
          head2 = 64;
};

template <class V>
void visit(V& v, PointTransformerConfig& c) {
  v("points", c.points, "points per cloud", between(1, kMostPoints));
  v("width", c.width, "channels of the attention", between(1, kMostWidth));
  v("layers", c.blocks, "blocks; each takes a quarter of the points and doubles the channels",
    between(0, 8));
  v("neighbours", c.neighbours, "neighbours of a point", between(1, kMostPoints));
  v("base", c.base, "channels of a point before the first block",
    added("32", between(1, kMostWidth)));
  v("head1", c.head1, "channels of the head's first layer", added("256", between(1, kMostWidth)));
  v("head2", c.head2, "channels of the head's second layer", added("64", between(1, kMostWidth)));
  v.check("layers", (c.points >> (2 * c.blocks)) > 0, "leave no points",
          "give fewer layers or more points");
}

struct TransitionDown : Module {
  TransitionDown(int64_t m, int64_t k, int64_t in, int64_t out, const Init& init)
      : sa(m, k, in, out, init.sub("sa")) {}
  void visit(Fields& f) override { f("sa", sa); }
  const char* kind() const override { return "TransitionDown"; }
  SetAbstraction sa;
};

struct PointTransformerBackbone : Module {
  PointTransformerBackbone(const PointTransformerConfig& c, const Init& init);
  /// cloud [n, v, 3] -> features [n, v / 4^blocks, base * 2^blocks].
  Var operator()(Context& ctx, const Var& cloud);
  void visit(Fields& f) override;
  const char* kind() const override { return "Backbone"; }
  ReluChain fc1;
  VectorAttention transformer1;
  ModuleList<TransitionDown> transition_downs;
  ModuleList<VectorAttention> transformers;
};

struct PointTransformer : SkeletonModel {
  using Config = PointTransformerConfig;
  PointTransformer(const PointTransformerConfig& c, const Init& init);
  SkeletonOutput forward(Context& ctx, const SkeletonInput& in) override;
  int64_t points() const override { return config.points; }
  void visit(Fields& f) override;
  const char* kind() const override { return "PointTransformer"; }
  PointTransformerConfig config;
  PointTransformerBackbone backbone;
  ReluChain fc2;
};

}  // namespace restage
