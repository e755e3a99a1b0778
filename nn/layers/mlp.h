// Chains of Linear layers with ReLU between them.
#pragma once

#include "nn/layers/linear.h"
#include "nn/layers/module_list.h"

namespace restage {

/// PyTorch's nn.Sequential(Linear, ReLU, Linear, ReLU, ..., Linear): names 0, 2, 4, ...
struct ReluChain : ModuleList<Linear> {
  ReluChain(std::initializer_list<int64_t> widths, const Init& init);
  Var operator()(Context& ctx, const Var& x) const;
  const char* kind() const override { return "Sequential"; }
};

}  // namespace restage
