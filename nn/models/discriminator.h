// `smrm/discriminator`: tells real motions of a skeleton from retargeted ones (spec 4.4).
#pragma once

#include <array>

#include "nn/config/rules.h"
#include "nn/layers/linear.h"
#include "nn/layers/module_list.h"
#include "nn/layers/norm.h"

namespace restage {

struct DiscriminatorConfig {
  int64_t in = 69, condition = 63;
  std::array<int64_t, 4> widths = {32, 64, 128, 256};
  bool nkn_head = false;  ///< the last layer of NKN, for windows of exactly 60 frames
};

template <class V>
void visit(V& v, DiscriminatorConfig& c) {
  v("nkn_head", c.nkn_head, "NKN's last layer, for windows of exactly 60 frames");
  v("widths", c.widths, "channels of the convolutions",
    added("[32, 64, 128, 256]", between(1, kMostWidth)));
}

struct Discriminator : Module {
  using Config = DiscriminatorConfig;
  Discriminator(const DiscriminatorConfig& c, const Init& init);
  /// x [n, t, in] (discriminator_input), condition [n, condition] (bone vectors) -> logits [n].
  Var operator()(Context& ctx, const Var& x, const Var& condition);
  void visit(Fields& f) override;
  const char* kind() const override { return "Discriminator"; }
  DiscriminatorConfig config;
  ModuleList<Conv1d> convs;
  ModuleList<BatchNormLayer> bns;
  Conv1d out;
};

/// Frame differences of joints [n, t, 22, 3] joined with the later frame's translation: [n, t-1,
/// 69].
Var discriminator_input(const Var& joints, const Var& trans);

}  // namespace restage
