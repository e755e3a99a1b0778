// Element-wise functions of one number: a row each, and nothing else. From its row come the name on
// the tape and in messages, the kernels of all devices, the function for C++ and Python, what is
// kept for the gradient, and the samples of the gradient harness (docs/extending.md).
//
// A row: the name; what it is; what the gradient is made from; where the harness tries it; the
// value, of x; the gradient, of g = dL/dy and of what is kept, x or y. Rows of the second table
// have a number of their own: its name, and one to try.
//
// Values are written in the operators + - * /, comparisons, where(condition, a, b), fma(a, b, c) =
// a b + c, the numbers zero and one, and the functions abs, sqrt, exp, log, sigmoid, softplus and
// tanh. A device that lacks one gets it in cpu/math-inl.h and cuda/elementwise.cu. NaN stays NaN.
#pragma once

// clang-format off
#define RESTAGE_UNARY(row)                                                                         \
  row(neg, "-x", of_nothing, all, -x, -g)                                                          \
  row(exp, "e^x", of_y, all, exp(x), g * y)                                                        \
  row(log, "natural logarithm", of_x, positive, log(x), g / x)                                     \
  row(sqrt, "square root", of_y, positive, sqrt(x), g / (y + y))                                   \
  row(square, "x x", of_x, all, x * x, (g + g) * x)                                                \
  row(abs, "|x|; derivative 0 at 0", of_x, no_zero,                                                \
      abs(x), where(x > zero, g, where(x < zero, -g, g * x)))                                      \
  row(sigmoid, "1 / (1 + e^-x)", of_y, all, sigmoid(x), g * y * (one - y))                         \
  row(tanh, "hyperbolic tangent", of_y, all, tanh(x), g * fma(-y, y, one))                         \
  row(relu, "max(x, 0); derivative 0 at 0", of_y, no_zero,                                         \
      where(x <= zero, zero, x), where(y <= zero, zero, g))                                        \
  row(softplus, "log(1 + e^x), without overflow", of_x, all, softplus(x), g * sigmoid(x))

#define RESTAGE_UNARY_WITH_NUMBER(row)                                                             \
  row(leaky_relu, slope, 0.2, "x, or slope x below 0", of_x, no_zero,                              \
      where(x > zero, x, slope * x), where(x > zero, g, slope * g))                                \
  row(scale, factor, -1.7, "factor x", of_nothing, all, factor * x, factor * g)                    \
  row(add_scalar, c, 3.1, "x + c", of_nothing, all, x + c, g)
// clang-format on
