// `transfer/tst`: Temporal Shape Transfer Network (Regateiro and Boyer, 3DV 2022), after its public
// program.
#pragma once

#include <array>

#include "nn/config/rules.h"
#include "nn/layers/lstm.h"
#include "nn/layers/spadain.h"
#include "nn/models/transfer.h"

namespace restage {

struct TstConfig {
  std::array<int64_t, 3> widths = {64, 128, 1024};
  int64_t vertices = 6890, code = 1024, hidden = 256, layers = 3, frames = 5;
};

template <class V>
void visit(V& v, TstConfig& c) {
  v("widths", c.widths, "channels of the branch that looks at points", between(1, kMostWidth));
  v("vertices", c.vertices, "vertices of source and target, which correspond",
    between(1, kMostPoints));
  v("code", c.code, "numbers that a whole frame is mapped to", between(1, kMostWidth));
  v("hidden", c.hidden, "units of the LSTM", between(1, kMostWidth));
  v("layers", c.layers, "layers of the LSTM", between(1, 16));
  v("frames", c.frames, "frames of a window", between(1, 64));
}

/// NPT's decoder behind two branches: one looks at each point, the other runs an LSTM over all
/// coordinates of each frame of the window. Frame t sees frames 0 to t.
struct Tst : TransferModel {
  using Config = TstConfig;
  Tst(const TstConfig& c, const Init& init);
  Var forward(Context& ctx, const TransferInput& in) override;
  /// One window [t, v, 3] with another identity for each frame [t, v, 3] -> [t, v, 3].
  Var window(Context& ctx, const Var& pose, const Var& identity) const;
  /// Both branches of windows [n, t, v, 3] -> [n, t, v, widths[2] + 3].
  Var encode(Context& ctx, const Var& pose) const;
  int64_t frames() const override { return config.frames; }
  bool corresponding() const override { return true; }
  void visit(Fields& f) override;
  const char* kind() const override { return "TST"; }
  TstConfig config;
  ModuleList<Linear> enc;
  Linear t_in, t_out;
  LstmLayer lstm;
  ModuleList<Linear> convs;
  ModuleList<SpadainBlock> blocks;
  Linear out;

 private:
  Var decode(Context& ctx, const Var& code, const Var& identity) const;
};

struct TstDiscriminatorConfig {
  int64_t vertices = 6890;
  std::array<int64_t, 2> widths = {512, 128};
};

template <class V>
void visit(V& v, TstDiscriminatorConfig& c) {
  v("vertices", c.vertices, "vertices of a frame", between(1, kMostPoints));
  v("widths", c.widths, "units of the two hidden layers", between(1, kMostWidth));
}

/// TST's discriminator: vertices [t, v, 3], one after the other -> how real each frame is [t, 1], 0
/// to 1. The public program never trains it (its optimiser holds the generator's parameters).
struct TstDiscriminator : Module {
  using Config = TstDiscriminatorConfig;
  TstDiscriminator(const TstDiscriminatorConfig& c, const Init& init);
  Var operator()(Context& ctx, const Var& vertices) const;
  /// The same before the sigmoid, for losses that must not overflow.
  Var logits(Context& ctx, const Var& vertices) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "TSTDiscriminator"; }
  TstDiscriminatorConfig config;
  Linear fc1, fc2, fc3;
};

}  // namespace restage
