// Element-wise ops with numpy broadcasting.
#pragma once

#include "autograd/kernels/elementwise.h"
#include "autograd/tape/tape.h"

namespace restage {

constexpr const char* name_of(Unary op) {
  constexpr const char* names[] = {"neg",      "exp",     "log",       "sqrt", "square",
                                   "abs",      "sigmoid", "tanh",      "relu", "leaky_relu",
                                   "softplus", "scale",   "add_scalar"};
  return names[static_cast<int>(op)];
}
constexpr const char* name_of(Binary op) {
  constexpr const char* names[] = {"add", "sub", "mul", "div"};
  return names[static_cast<int>(op)];
}

/// y = f(x), any shape.
template <Unary U>
struct UnaryOp {
  static constexpr const char* name = name_of(U);
  static constexpr const char* letters = "x[...]";
  double alpha = 0;
  void check(Inputs x) const { require_floats(name, letters, x); }
  Tensor forward(Inputs x, Saved& saved) const {
    Tensor y = empty_like(x[0]);
    launch(UnaryArgs{U, x[0], y, alpha});
    if constexpr (derivative(U) == Derivative::of_x) saved.keep({x[0]});
    if constexpr (derivative(U) == Derivative::of_y) saved.keep({y});
    return y;
  }
  Grads backward(const Saved& saved, const Tensor& gy, Needs) const {
    Tensor gx = empty_like(gy);
    const Tensor* kept = derivative(U) == Derivative::of_nothing ? nullptr : &saved[0];
    launch(UnaryGradArgs{U, kept, gy, gx, alpha});
    return {gx};
  }
};

/// y = f(a, b), numpy broadcasting.
template <Binary B>
struct BinaryOp {
  static constexpr const char* name = name_of(B);
  static constexpr const char* letters = "a[...], b[...] broadcastable";
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

/// x repeated to a larger shape (numpy broadcasting).
struct Expand {
  static constexpr const char* name = "expand";
  static constexpr const char* letters = "x[...]";
  Shape shape;
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

/// Each element kept with probability 1 - p and divided by it; the mask is a function of the key.
struct Dropout {
  static constexpr const char* name = "dropout";
  static constexpr const char* letters = "x[...]";
  double p = 0;
  RngKey key;
  /// Dropout of relu(x), in one pass each way. The result shows which elements both let through, so
  /// the mask is not drawn again for the gradient.
  bool relu = false;
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

inline Var neg(const Var& x) { return call(UnaryOp<Unary::neg>{}, {x}); }
inline Var exp(const Var& x) { return call(UnaryOp<Unary::exp>{}, {x}); }
inline Var log(const Var& x) { return call(UnaryOp<Unary::log>{}, {x}); }
inline Var sqrt(const Var& x) { return call(UnaryOp<Unary::sqrt>{}, {x}); }
inline Var square(const Var& x) { return call(UnaryOp<Unary::square>{}, {x}); }
inline Var abs(const Var& x) { return call(UnaryOp<Unary::abs>{}, {x}); }
inline Var sigmoid(const Var& x) { return call(UnaryOp<Unary::sigmoid>{}, {x}); }
inline Var tanh(const Var& x) { return call(UnaryOp<Unary::tanh>{}, {x}); }
inline Var relu(const Var& x) { return call(UnaryOp<Unary::relu>{}, {x}); }
inline Var leaky_relu(const Var& x, double slope) {
  return call(UnaryOp<Unary::leaky_relu>{slope}, {x});
}
/// log(1 + e^x), without overflow.
inline Var softplus(const Var& x) { return call(UnaryOp<Unary::softplus>{}, {x}); }
inline Var scale(const Var& x, double factor) { return call(UnaryOp<Unary::scale>{factor}, {x}); }
inline Var add_scalar(const Var& x, double c) { return call(UnaryOp<Unary::add_scalar>{c}, {x}); }
inline Var add(const Var& a, const Var& b) { return call(BinaryOp<Binary::add>{}, {a, b}); }
inline Var sub(const Var& a, const Var& b) { return call(BinaryOp<Binary::sub>{}, {a, b}); }
inline Var mul(const Var& a, const Var& b) { return call(BinaryOp<Binary::mul>{}, {a, b}); }
inline Var div(const Var& a, const Var& b) { return call(BinaryOp<Binary::div>{}, {a, b}); }
inline Var operator+(const Var& a, const Var& b) { return add(a, b); }
inline Var operator-(const Var& a, const Var& b) { return sub(a, b); }
inline Var operator*(const Var& a, const Var& b) { return mul(a, b); }
inline Var operator*(const Var& a, double c) { return scale(a, c); }
inline Var operator/(const Var& a, const Var& b) { return div(a, b); }
inline Var expand(const Var& x, const Shape& shape) { return call(Expand{shape}, {x}); }
inline Var dropout(const Var& x, double p, const RngKey& key) {
  return p <= 0 ? x : call(Dropout{p, key}, {x});
}
inline Var relu_dropout(const Var& x, double p, const RngKey& key) {
  return call(Dropout{p, key, true}, {x});
}

/// Sums t down to a shape that it was broadcast from (no gradient; used by backward passes).
Tensor sum_to(const Tensor& t, const Shape& shape);
/// Binary kernel on tensors (no gradient; for backward passes and data).
Tensor binary(Binary op, const Tensor& a, const Tensor& b);

}  // namespace restage
