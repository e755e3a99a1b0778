// Element-wise ops with numpy broadcasting.
#pragma once

#include "autograd/kernels/elementwise.h"
#include "autograd/tape/tape.h"

namespace restage {

constexpr const char* name_of(Unary op) {
  constexpr const char* names[] = {
#define RESTAGE_NAME(name, ...) #name,
      RESTAGE_UNARY(RESTAGE_NAME) RESTAGE_UNARY_WITH_NUMBER(RESTAGE_NAME)
#undef RESTAGE_NAME
  };
  return names[static_cast<int>(op)];
}
constexpr const char* name_of(Binary op) {
  constexpr const char* names[] = {
#define RESTAGE_NAME(name, ...) #name,
      RESTAGE_BINARY(RESTAGE_NAME)
#undef RESTAGE_NAME
  };
  return names[static_cast<int>(op)];
}
constexpr const char* letters_of(Binary op) {
  constexpr const char* letters[] = {
#define RESTAGE_LETTERS(name, a, b, ...) #a "[...], " #b "[...] broadcastable",
      RESTAGE_BINARY(RESTAGE_LETTERS)
#undef RESTAGE_LETTERS
  };
  return letters[static_cast<int>(op)];
}

/// y = f(x), any shape.
template <Unary U>
struct UnaryOp {
  static constexpr const char* name = name_of(U);
  static constexpr const char* letters = "x[...]";
  double number = 0;
  void check(Inputs x) const { require_floats(name, letters, x); }
  Tensor forward(Inputs x, Saved& saved) const {
    Tensor y = empty_like(x[0]);
    launch(UnaryArgs{U, x[0], y, number});
    if constexpr (derivative(U) == Derivative::of_x) saved.keep({x[0]});
    if constexpr (derivative(U) == Derivative::of_y) saved.keep({y});
    return y;
  }
  Grads backward(const Saved& saved, const Tensor& gy, Needs) const {
    Tensor gx = empty_like(gy);
    const Tensor* kept = derivative(U) == Derivative::of_nothing ? nullptr : &saved[0];
    launch(UnaryGradArgs{U, kept, gy, gx, number});
    return {gx};
  }
};

/// y = f(a, b), numpy broadcasting.
template <Binary B>
struct BinaryOp {
  static constexpr const char* name = name_of(B);
  static constexpr const char* letters = letters_of(B);
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

// The functions of unary_rows.h: exp(x), relu(x), scale(x, factor) and the others.
#define RESTAGE_FUNCTION(name, ...) \
  inline Var name(const Var& x) { return call(UnaryOp<Unary::name>{}, {x}); }
RESTAGE_UNARY(RESTAGE_FUNCTION)
#undef RESTAGE_FUNCTION
#define RESTAGE_FUNCTION(name, number, ...) \
  inline Var name(const Var& x, double number) { return call(UnaryOp<Unary::name>{number}, {x}); }
RESTAGE_UNARY_WITH_NUMBER(RESTAGE_FUNCTION)
#undef RESTAGE_FUNCTION
// The functions of binary_rows.h: add(a, b), atan2(y, x) and the others.
#define RESTAGE_FUNCTION(name, a, b, ...) \
  inline Var name(const Var& a, const Var& b) { return call(BinaryOp<Binary::name>{}, {a, b}); }
RESTAGE_BINARY(RESTAGE_FUNCTION)
#undef RESTAGE_FUNCTION
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
