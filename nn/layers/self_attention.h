// A pre-norm transformer encoder layer over tokens (Vaswani et al. 2017; pre-norm as in Xiong et
// al. 2020).
#pragma once

#include "nn/layers/linear.h"
#include "nn/layers/norm.h"

namespace restage {

/// x += Wo attention(norm1(x)); x += W2 relu(W1 norm2(x)). x [n, t, width].
struct EncoderLayer : Module {
  EncoderLayer(int64_t width, int64_t heads, int64_t hidden, const Init& init);
  Var operator()(Context& ctx, const Var& x) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "EncoderLayer"; }
  LayerNormLayer norm1;
  Linear qkv, out;
  LayerNormLayer norm2;
  Linear fc1, fc2;

 private:
  Var attention(Context& ctx, const Var& x) const;
  int64_t heads_;
};

}  // namespace restage
