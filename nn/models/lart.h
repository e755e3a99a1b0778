// `transfer/lart`: LART (Chen et al. 2023), as far as paper and the programs before it say what it
// is (docs/systems/lart.md).
#pragma once

#include <array>

#include "nn/config/rules.h"
#include "nn/layers/cross_attention.h"
#include "nn/layers/spadain.h"
#include "nn/models/transfer.h"

namespace restage {

struct LartConfig {
  std::array<int64_t, 3> widths = {64, 128, 1024};
  int64_t frames = 3;
  bool first_norm = false, own_start = false;
};

template <class V>
void visit(V& v, LartConfig& c) {
  v("widths", c.widths,
    "channels of the encoder; the decoder has the last, its half twice, a quarter",
    between(4, kMostWidth));
  v("frames", c.frames, "frames of a window", between(1, 64));
  v("first_norm", c.first_norm,
    "instance norm in the first block, too: the answer does then not depend on the pose");
  v("own_start", c.own_start,
    "weights begin as those of its predecessors, with a deviation of 0.02; else as PyTorch's");
}

/// Each frame is pooled to one code, to which its place in the window adds a learned vector. The
/// code is repeated at the target's vertices and decoded by four steps: a convolution on the code
/// and on the encoded target, attention of the target over the code, a SPAdaIN block.
struct Lart : TransferModel {
  using Config = LartConfig;
  Lart(const LartConfig& c, const Init& init);
  Var forward(Context& ctx, const TransferInput& in) override;
  /// The code at `share` between those of the two frames, decoded (section 4, interpolation).
  std::optional<Var> between(Context& ctx, const TransferInput& in, double share) const override;
  int64_t frames() const override { return config.frames; }
  /// Codes of a window's frames [n, t, c]; `last`: of its last frame only, [n, 1, c].
  Var codes(Context& ctx, const Var& pose, bool last = false) const;
  /// The target [n, v, 3] in the poses of codes [n, t, c] -> [n, t, v, 3].
  Var decode(Context& ctx, const Var& code, const Var& identity) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "LART"; }
  LartConfig config;
  Parameter time;
  PoseEncoder enc;
  ModuleList<Linear> convs;
  ModuleList<GatedCrossAttention> att;
  ModuleList<SpadainBlock> blocks;
  Linear out;
};

}  // namespace restage
