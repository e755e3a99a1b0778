// The rows of binary_rows.h as functions, for kernels of any device.
#pragma once

#include <math.h>  // pow, log and atan2 by the names that nvcc knows

#include "autograd/kernels/elementwise.h"

#ifdef __CUDACC__
#define RESTAGE_ANYWHERE __host__ __device__
#define RESTAGE_APART __noinline__
#else
#define RESTAGE_ANYWHERE
#define RESTAGE_APART __attribute__((noinline))
#endif

namespace restage::binary_values {

template <class T>
RESTAGE_ANYWHERE inline T where(bool condition, T a, T b) {
  return condition ? a : b;
}
// In double, whatever the numbers are.
template <class T>
RESTAGE_ANYWHERE inline T power(T a, T b) {
  return static_cast<T>(::pow(static_cast<double>(a), static_cast<double>(b)));
}
template <class T>
RESTAGE_ANYWHERE inline T logarithm(T a) {
  return static_cast<T>(::log(static_cast<double>(a)));
}
template <class T>
RESTAGE_ANYWHERE inline T angle(T y, T x) {
  return static_cast<T>(::atan2(static_cast<double>(y), static_cast<double>(x)));
}
/// g z / (x^2 + y^2); 0 near the origin, where the angle means nothing. Never part of a caller that
/// is compiled for other instructions: these would fuse its products and sums to other bits.
template <class T>
RESTAGE_ANYWHERE RESTAGE_APART T by_radius(T g, T y, T x, T z) {
  const double a = y, b = x, square = a * a + b * b;
  const double factor = square <= 1e-12 ? 0 : g / square;
  return static_cast<T>(factor * z);
}

/// value(a, b), and the gradients by<0>(g, a, b) and by<1>(g, a, b) of its numbers.
template <Binary op>
struct Row;
#define RESTAGE_ROW(name, a, b, help, domain, formula, of_a, by_a, of_b, by_b) \
  template <>                                                                  \
  struct Row<Binary::name> {                                                   \
    template <class T>                                                         \
    RESTAGE_ANYWHERE static T value(T a, T b) {                                \
      [[maybe_unused]] const T zero = 0;                                       \
      return formula;                                                          \
    }                                                                          \
    template <int input, class T>                                              \
    RESTAGE_ANYWHERE static T by([[maybe_unused]] T g, [[maybe_unused]] T a,   \
                                 [[maybe_unused]] T b) {                       \
      [[maybe_unused]] const T zero = 0, one = 1;                              \
      if constexpr (input == 0)                                                \
        return by_a;                                                           \
      else                                                                     \
        return by_b;                                                           \
    }                                                                          \
  };
RESTAGE_BINARY(RESTAGE_ROW)
#undef RESTAGE_ROW

}  // namespace restage::binary_values
