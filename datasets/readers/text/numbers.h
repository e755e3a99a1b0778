// The kinds of numbers that binary formats store (PLY, NPY, glTF), in either byte order.
#pragma once

#include <Eigen/Core>
#include <bit>
#include <cstddef>
#include <cstring>
#include <limits>

namespace restage {

/// One kind: its size, and how its bytes become a double.
struct Number {
  size_t bytes;
  bool integer;
  double largest;
  double (*at)(const char* bytes, bool big_endian);
};

template <class T>
double number_at(const char* bytes, bool big_endian = false) {
  char raw[sizeof(T)];
  const bool swap = big_endian != (std::endian::native == std::endian::big);
  for (size_t i = 0; i < sizeof(T); ++i) raw[i] = bytes[swap ? sizeof(T) - 1 - i : i];
  T value;
  std::memcpy(&value, raw, sizeof value);
  return static_cast<double>(value);
}

template <class T>
inline constexpr Number kNumber = {sizeof(T), std::numeric_limits<T>::is_integer,
                                   static_cast<double>(std::numeric_limits<T>::max()),
                                   number_at<T>};
template <>
inline constexpr Number kNumber<Eigen::half> = {2, false, 65504, number_at<Eigen::half>};

}  // namespace restage
