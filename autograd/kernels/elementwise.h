// Element-wise kernels. f32 and f64. No output may alias an input unless said so.
#pragma once

#include "autograd/base/rng.h"
#include "autograd/kernels/kernel.h"

namespace restage {

enum class Unary {
  neg,
  exp,
  log,
  sqrt,
  square,
  abs,
  sigmoid,
  tanh,
  relu,
  leaky_relu,
  softplus,
  scale,
  add_scalar
};
/// out = f(x); `alpha` is the slope of leaky_relu, the factor of scale, the addend of add_scalar.
struct UnaryArgs {
  Unary op;
  const Tensor& x;
  Tensor& out;
  double alpha = 0;
};
/// What f'(x) is computed from: neg, scale and add_scalar need nothing.
enum class Derivative { of_nothing, of_x, of_y };
constexpr Derivative derivative(Unary op) {
  switch (op) {
    case Unary::neg:
    case Unary::scale:
    case Unary::add_scalar:
      return Derivative::of_nothing;
    case Unary::exp:
    case Unary::sqrt:
    case Unary::sigmoid:
    case Unary::tanh:
    case Unary::relu:
      return Derivative::of_y;
    default:
      return Derivative::of_x;
  }
}
/// out = gy * f'(x). At kinks (relu, abs at 0) the derivative is 0.
struct UnaryGradArgs {
  Unary op;
  const Tensor* kept;  ///< x or y = f(x), as derivative(op) says; null where it needs neither
  const Tensor& gy;
  Tensor& out;
  double alpha = 0;
};

enum class Binary { add, sub, mul, div };
/// out = f(a, b), numpy broadcasting; out has the broadcast shape.
struct BinaryArgs {
  Binary op;
  const Tensor& a;
  const Tensor& b;
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
