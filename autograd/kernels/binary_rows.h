// Element-wise functions of two numbers, broadcast as in NumPy: a row each, and nothing else. From
// its row come all that come from a row of unary_rows.h.
//
// A row: the name; the names of its numbers; what it is; where the harness tries the first; the
// value; then, of the first number and of the second, what the gradient is made from, and the
// gradient, of g = dL/dy and of the two numbers.
//
// Formulas are written in the operators + - * /, comparisons, where(condition, a, b), the numbers
// zero and one, and the functions of binary_values.h. NaN stays NaN. Where products stand inside of
// where(), GCC takes a branch for each number and no vectors: prelu chooses first and multiplies
// then.
#pragma once

// clang-format off
#define RESTAGE_BINARY(row)                                                                        \
  row(add, a, b, "a + b, broadcast as in NumPy", all, a + b, is_g, g, is_g, g)                     \
  row(sub, a, b, "a - b", all, a - b, is_g, g, of_g, -g)                                           \
  row(mul, a, b, "a b, element by element", all, a * b, of_second, g * b, of_first, g * a)         \
  row(div, a, b, "a / b", all, a / b, of_second, g / b, of_both, -(g / b * a / b))                 \
  row(minimum, a, b, "the smaller of two; of equal ones a has the gradient", all,                  \
      where(a <= b, a, where(b < a, b, a + b)),                                                    \
      of_both, where(a <= b, g, where(b < a, zero, g * (a + b))),                                  \
      of_both, where(a <= b, zero, where(b < a, g, g * (a + b))))                                  \
  row(maximum, a, b, "the larger of two; of equal ones a has the gradient", all,                   \
      where(a >= b, a, where(b > a, b, a + b)),                                                    \
      of_both, where(a >= b, g, where(b > a, zero, g * (a + b))),                                  \
      of_both, where(a >= b, zero, where(b > a, g, g * (a + b))))                                  \
  row(pow, a, b, "a^b; derivative 0 by b where a is 0 or less", positive, power(a, b),             \
      of_both, g * b * power(a, b - one),                                                          \
      of_both, where(a <= zero, zero, g * power(a, b) * logarithm(a)))                             \
  row(prelu, x, slope, "x, or slope x where x is 0 or less", no_zero,                              \
      where(x > zero, x, zero) + slope * where(x > zero, zero, x),                                 \
      of_both, where(x > zero, g, zero) + slope * where(x > zero, zero, g),                        \
      of_both, g * where(x > zero, zero, x))                                                       \
  row(atan2, y, x,                                                                                 \
      "angle of the direction (x, y), radians in (-pi, pi]; derivatives 0 within 1e-6 of (0, 0)",  \
      all, angle(y, x), of_both, by_radius(g, y, x, x), of_both, -by_radius(g, y, x, y))
// clang-format on
