// `skeleton/patch_transformer`: our own small extractor for CPUs (docs/method.md). Patches around
// the farthest points become tokens of a transformer; every token votes for every joint.
#pragma once

#include <optional>

#include "nn/config/rules.h"
#include "nn/layers/mlp.h"
#include "nn/layers/self_attention.h"
#include "nn/models/second_look.h"

namespace restage {

struct PatchTransformerConfig {
  int64_t points = 512, centres = 64, neighbours = 16, patch = 64, width = 128, layers = 4,
          heads = 4;
  bool orientation = false, uncertainty = false, memory = false;
  int64_t looks = 1;
  // What brings offsets and positions in metres to order one.
  double patch_scale = 10, centre_scale = 2, memory_scale = 4;
};

template <class V>
void visit(V& v, PatchTransformerConfig& c) {
  v("points", c.points, "points per cloud", between(1, kMostPoints));
  v("width", c.width, "channels of a token", between(1, kMostWidth));
  v("layers", c.layers, "layers of the transformer", between(0, 64));
  v("centres", c.centres, "patches, each a token", between(1, kMostPoints));
  v("neighbours", c.neighbours, "points of a patch", between(1, kMostPoints));
  v("orientation", c.orientation, "also the rotation of each joint");
  v("uncertainty", c.uncertainty, "also how far each joint may be off");
  v("patch", c.patch, "channels of a point of a patch", added("64", between(1, kMostWidth)));
  v("heads", c.heads, "of the attention; they share the channels of a token",
    added("4", between(1, kMostWidth)));
  v("patch_scale", c.patch_scale, "of a point's place in its patch, per metre",
    added("10", positive()));
  v("centre_scale", c.centre_scale, "of a patch's place in the cloud, per metre",
    added("2", positive()));
  v("memory_scale", c.memory_scale, "of where a joint was, seen from a patch, per metre",
    added("4", positive()));
  v("memory", c.memory, "also reads where the joints were a frame before");
  v("looks", c.looks, "how often it looks: after the first time around each joint", between(1, 4));
  v.check("width", c.width % c.heads == 0, "does not fit the heads",
          "give a multiple of " + std::to_string(c.heads));
  v.check("centres", c.centres <= c.points, "are more than the points",
          "give at most " + std::to_string(c.points));
}

struct PatchTransformer : SkeletonModel {
  using Config = PatchTransformerConfig;
  PatchTransformer(const PatchTransformerConfig& c, const Init& init);
  SkeletonOutput forward(Context& ctx, const SkeletonInput& in) override;
  int64_t points() const override { return config.points; }
  void visit(Fields& f) override;
  const char* kind() const override { return "PatchTransformer"; }
  PatchTransformerConfig config;
  ReluChain point, position;  ///< layers of each neighbour; layers of each centre
  Linear mix;                 ///< applied to the maximum over the neighbours
  ModuleList<EncoderLayer> layers;
  LayerNormLayer norm;
  Linear vote;     ///< 22 logits and 22 offsets per token
  Linear segment;  ///< which joint moves the centre (used by the training loss only)
  std::optional<Linear> orientation;  ///< 22 logits and 22 x 6 numbers per token
  std::optional<Linear> uncertainty;  ///< 22 numbers per token, weighted as the votes are
  /// Layers of where a centre lies relative to each remembered joint.
  std::optional<ReluChain> memory;
  ModuleList<SecondLook> again;  ///< looks - 1
};

}  // namespace restage
