// Matrix products.
#pragma once

#include "autograd/kernels/matmul.h"
#include "autograd/tape/tape.h"

namespace restage {

/// y = act(x W^T + b), PyTorch's layout; the bias may be missing. Bias and activation are part of
/// the product's last pass.
struct LinearOp {
  static constexpr const char* name = "linear";
  static constexpr const char* letters = "x[..., i], W[o, i], b[o]";
  Activation activation = Activation::none;
  /// The precision in use when the op is made; the backward pass has it, too.
  MatmulPrecision precision = matmul_precision();
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

/// a [b?, m, k] times c [b?, k, n] (transposed on request); a matrix without batch axis is shared.
struct Matmul {
  static constexpr const char* name = "matmul";
  static constexpr const char* letters = "a[b?, m, k], c[b?, k, n]";
  bool transpose_a = false, transpose_b = false;
  MatmulPrecision precision = matmul_precision();  ///< see LinearOp
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

inline Var linear(const Var& x, const Var& weight, const Var& bias,
                  Activation activation = Activation::none) {
  return call(LinearOp{activation}, {x, weight, bias});
}
inline Var linear(const Var& x, const Var& weight) { return call(LinearOp{}, {x, weight}); }
inline Var matmul(const Var& a, const Var& b, bool transpose_a = false, bool transpose_b = false) {
  return call(Matmul{transpose_a, transpose_b}, {a, b});
}

}  // namespace restage
