// Element-wise kernels. f32 and f64. No output may alias an input unless said so.
#pragma once

#include "autograd/base/rng.h"
#include "autograd/kernels/binary_rows.h"
#include "autograd/kernels/kernel.h"
#include "autograd/kernels/unary_rows.h"

namespace restage {

enum class Unary {
#define RESTAGE_NAME(name, ...) name,
  RESTAGE_UNARY(RESTAGE_NAME) RESTAGE_UNARY_WITH_NUMBER(RESTAGE_NAME)
#undef RESTAGE_NAME
};
#define RESTAGE_ONE(...) +1
inline constexpr int kUnaryOps = RESTAGE_UNARY(RESTAGE_ONE) RESTAGE_UNARY_WITH_NUMBER(RESTAGE_ONE);
#undef RESTAGE_ONE
/// out = f(x); `number` is that of functions which have one.
struct UnaryArgs {
  Unary op;
  const Tensor& x;
  Tensor& out;
  double number = 0;
};
/// What f'(x) is computed from.
enum class Derivative { of_nothing, of_x, of_y };
constexpr Derivative derivative(Unary op) {
  using enum Derivative;
  constexpr Derivative of[] = {
#define RESTAGE_KEPT(name, help, kept, ...) kept,
#define RESTAGE_KEPT_WITH_NUMBER(name, number, tried, help, kept, ...) kept,
      RESTAGE_UNARY(RESTAGE_KEPT) RESTAGE_UNARY_WITH_NUMBER(RESTAGE_KEPT_WITH_NUMBER)
#undef RESTAGE_KEPT
#undef RESTAGE_KEPT_WITH_NUMBER
  };
  return of[static_cast<int>(op)];
}
/// out = gy * f'(x). At kinks (relu, abs at 0) the derivative is 0.
struct UnaryGradArgs {
  Unary op;
  const Tensor* kept;  ///< x or y = f(x), as derivative(op) says; null where it needs neither
  const Tensor& gy;
  Tensor& out;
  double number = 0;
};

enum class Binary {
#define RESTAGE_NAME(name, ...) name,
  RESTAGE_BINARY(RESTAGE_NAME)
#undef RESTAGE_NAME
};
#define RESTAGE_ONE(...) +1
inline constexpr int kBinaryOps = RESTAGE_BINARY(RESTAGE_ONE);
#undef RESTAGE_ONE
/// out = f(a, b), numpy broadcasting; out has the broadcast shape.
struct BinaryArgs {
  Binary op;
  const Tensor& a;
  const Tensor& b;
  Tensor& out;
};
/// What a gradient of f(a, b) is computed from: it is g = dL/dy, or of g alone, or also of the
/// first number, of the second, or of both.
enum class Partial { is_g, of_g, of_first, of_second, of_both };
/// Of number `input` (0 or 1).
constexpr Partial partial(Binary op, int input) {
  using enum Partial;
  constexpr Partial of[][2] = {
#define RESTAGE_KEPT(name, a, b, help, domain, value, of_a, by_a, of_b, by_b) {of_a, of_b},
      RESTAGE_BINARY(RESTAGE_KEPT)
#undef RESTAGE_KEPT
  };
  return of[static_cast<int>(op)][input];
}
/// out = the gradient of number `input`, before it is summed to that number's shape; gy and out
/// have the broadcast shape.
struct BinaryGradArgs {
  Binary op;
  int input;        ///< 0 or 1
  const Tensor* a;  ///< null where partial() needs none
  const Tensor* b;
  const Tensor& gy;
  Tensor& out;
};
/// out += a (same shape): accumulation of gradients.
struct AccumulateArgs {
  const Tensor& a;
  Tensor& out;
};
/// out[i] = keep(i) ? x[i] / (1 - p) : 0, keep a function of (key, i) (see rng.h); relu(x) for x on
/// request.
struct DropoutArgs {
  const Tensor& x;
  Tensor& out;
  double p;
  RngKey key;
  bool relu = false;
};
/// Gradient of DropoutArgs with relu, from its result y, whose zeros are those of both:
/// out = y > 0 ? gy / (1 - p) : 0.
struct ReluDropoutGradArgs {
  const Tensor& y;
  const Tensor& gy;
  Tensor& out;
  double p;
};
/// out = x repeated to out's shape (numpy broadcasting).
struct ExpandArgs {
  const Tensor& x;
  Tensor& out;
};
/// out = x converted, by way of float64, to the dtype of out, which differs from that of x. All
/// four dtypes.
struct CastArgs {
  const Tensor& x;
  Tensor& out;
};
/// out[0] = 1 if any element of x is NaN or infinite, else 0.
struct NonFiniteArgs {
  const Tensor& x;
  Tensor& out;
};

}  // namespace restage
