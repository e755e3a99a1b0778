// Linear layers and convolutions that are linear layers per point.
#pragma once

#include "autograd/ops/linear.h"
#include "nn/module.h"

namespace restage {

/// y = act(W x + b) over the last axis; weight [out, in]. `tail` trailing 1-axes are kept in the
/// weight's shape, so that this layer takes the weights of PyTorch's 1x1 convolutions ([out, in, 1]
/// or [out, in, 1, 1]).
struct Linear : Module {
  Linear(int64_t in, int64_t out, const Init& init, bool with_bias = true, int tail = 0);
  Var operator()(Context& ctx, const Var& x, Activation activation = Activation::none) const;
  /// The weight [out, in], without its tail.
  Var matrix(Context& ctx) const;
  /// Makes weights a hundredth of what they were and biases zero, so that the layer's answer is
  /// near zero before training.
  void start_small();
  void visit(Fields& f) override;
  const char* kind() const override {
    return tail_ == 0 ? "Linear" : tail_ == 1 ? "Conv1d" : "Conv2d";
  }
  Parameter weight, bias;

 private:
  bool with_bias_;
  int tail_;
};

/// 1-D convolution over x [n, l, c] with PyTorch's weight [out, in, k]; output length ceil(l /
/// stride) with the larger half of the padding last ("same"), or without padding ("valid").
struct Conv1d : Module {
  Conv1d(int64_t in, int64_t out, int64_t k, const Init& init);
  Var same(Context& ctx, const Var& x, int64_t stride) const;
  Var valid(Context& ctx, const Var& x, int64_t stride) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "Conv1d"; }
  Parameter weight, bias;
};

/// Zeroes elements in training with probability p; every call has a mask of its own
/// (Context::next_mask).
Var dropout(Context& ctx, const Var& x, double p);
/// dropout(relu(x)) in one pass.
Var relu_dropout(Context& ctx, const Var& x, double p);

}  // namespace restage
