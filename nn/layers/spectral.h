// Spectral normalisation (Miyato et al. 2018) in the form of torch.nn.utils.spectral_norm.
#pragma once

#include "nn/module.h"

namespace restage {

/// y = W / (u' W v) x + b over the last axis, a 1x1 convolution: weight_orig [out, in, 1]. Every
/// training pass makes one power iteration first (v = unit(W' u), u = unit(W v)) and keeps both;
/// evaluation takes them as they are kept. No gradient goes through u and v. They start as random
/// unit vectors: before the first training pass the answers say nothing.
struct SpectralLinear : Module {
  SpectralLinear(int64_t in, int64_t out, const Init& init, bool with_bias = true);
  Var operator()(Context& ctx, const Var& x);
  void visit(Fields& f) override;
  const char* kind() const override { return "SpectralConv1d"; }
  bool changes_buffers() const override { return true; }
  Parameter weight, bias;
  Tensor u, v;

 private:
  bool with_bias_;
};

}  // namespace restage
