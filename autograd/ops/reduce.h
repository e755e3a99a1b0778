// Sums, means, maxima, softmax, and the losses made of them. Negative axes count from the end.
#pragma once

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"

namespace restage {

/// Sum over one axis (removed).
struct Sum {
  static constexpr const char* name = "sum";
  static constexpr const char* letters = "x[... n ...]";
  int axis = -1;
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

/// Largest element along one axis (removed); the gradient goes to the first maximum.
struct Max {
  static constexpr const char* name = "max";
  static constexpr const char* letters = "x[... n ...], n > 0";
  int axis = -1;
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

/// Softmax along one axis, maximum subtracted.
struct Softmax {
  static constexpr const char* name = "softmax";
  static constexpr const char* letters = "x[... n ...], n > 0";
  int axis = -1;
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

inline Var sum(const Var& x, int axis) { return call(Sum{axis}, {x}); }
inline Var max(const Var& x, int axis) { return call(Max{axis}, {x}); }
inline Var softmax(const Var& x, int axis = -1) { return call(Softmax{axis}, {x}); }
Var mean(const Var& x, int axis);
/// Sum and mean of all elements, as a scalar of shape [1].
Var sum_all(const Var& x);
Var mean_all(const Var& x);
/// Lengths of vectors along the last axis (removed): sqrt(|x|^2 + epsilon), which has a derivative
/// where a vector is zero.
Var smooth_length(const Var& x, double epsilon);
/// Mean squared error over all elements of two equal shapes (spec 7).
Var mse(const Var& a, const Var& b);
/// Mean binary cross-entropy of logits against a constant label in [0, 1].
Var bce_with_logits(const Var& logits, double label);

}  // namespace restage
