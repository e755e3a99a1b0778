// Normalisation layers (spec 7).
#pragma once

#include "autograd/ops/norm.h"
#include "nn/layers/linear.h"

namespace restage {

/// Batch norm per channel (last axis): normalises by the statistics of the batch in training, by
/// running averages in evaluation. PyTorch's names; num_batches_tracked is not kept.
struct BatchNormLayer : Module {
  BatchNormLayer(int64_t channels, const Init& init);
  Var operator()(Context& ctx, const Var& x);
  /// max over v of act(this(map(x))), x [n, v, i] -> [n, o], in training as one op. `map` must have
  /// a bias.
  Var pooled(Context& ctx, const Linear& map, const Var& x, Activation activation);
  void visit(Fields& f) override;
  const char* kind() const override { return "BatchNorm"; }
  bool changes_buffers() const override { return true; }
  Parameter weight, bias;
  Tensor running_mean, running_var;
  double eps = 1e-5, momentum = 0.1;

 private:
  void update(const BatchStatistics& batch);
};

/// Layer norm of each row over the last axis.
struct LayerNormLayer : Module {
  LayerNormLayer(int64_t channels, const Init& init);
  Var operator()(Context& ctx, const Var& x) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "LayerNorm"; }
  Parameter weight, bias;
};

}  // namespace restage
