// `transfer/npt` and `transfer/npt_pool`: Neural Pose Transfer (Wang et al., CVPR 2020).
#pragma once

#include <array>

#include "nn/config/rules.h"
#include "nn/layers/spadain.h"
#include "nn/models/transfer.h"

namespace restage {

struct NptConfig {
  std::array<int64_t, 3> widths = {64, 128, 1024};
  bool pool = false, own_start = false;
};

template <class V>
void visit(V& v, NptConfig& c) {
  v("widths", c.widths, "channels of the pose encoder; the decoder begins with three more",
    between(1, kMostWidth));
  v("pool", c.pool,
    "the pose is the maximum over its points; else point i of the pose goes with vertex i of the "
    "target, whatever their order");
  v("own_start", c.own_start,
    "weights begin as its program's do, with a deviation of 0.02; else as PyTorch's");
}

/// The pose code, joined with the target's coordinates, through three convolutions, each with a
/// SPAdaIN block. With `pool` the first block has no norm (SpadainBlock).
struct Npt : TransferModel {
  using Config = NptConfig;
  Npt(const NptConfig& c, const Init& init);
  Var forward(Context& ctx, const TransferInput& in) override;
  bool equal_counts() const override { return !config.pool; }
  /// The first convolution of code [n, v or 1, c] and coordinates [n, v, 3] beside each other.
  Var join(Context& ctx, const Var& code, const Var& mesh) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "NPT"; }
  NptConfig config;
  PoseEncoder enc;
  ModuleList<Linear> convs;
  ModuleList<SpadainBlock> blocks;
  Linear out;
};

/// What NPT, LART and TST end with: points within 2 m of the origin.
Var points_of(Context& ctx, const Linear& out, const Var& x);

}  // namespace restage
