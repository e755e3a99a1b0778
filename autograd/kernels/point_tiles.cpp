#include "autograd/kernels/point_tiles.h"

#include <algorithm>
#include <array>

namespace restage {
namespace {

template <class T>
int longest_side(const T* xyz, const int32_t* first, const int32_t* last) {
  std::array<T, 3> side{};
  for (int c = 0; c < 3; ++c) {
    T lo = xyz[3 * *first + c], hi = lo;
    for (const int32_t* p = first; p != last; ++p) {
      const T x = xyz[3 * *p + c];
      lo = x < lo ? x : lo;
      hi = x > hi ? x : hi;
    }
    side[c] = hi - lo;
  }
  return static_cast<int>(std::max_element(side.begin(), side.end()) - side.begin());
}

}  // namespace

template <class T>
void sort_into_tiles(const T* xyz, int32_t* first, int32_t* last, int64_t size, int64_t group) {
  const int64_t tiles = (last - first + size - 1) / size;
  if (tiles <= 1) return std::sort(first, last);
  int64_t half = (tiles + 1) / 2;
  if (tiles > group) half = (half + group - 1) / group * group;
  int32_t* middle = first + half * size;
  const int axis = longest_side(xyz, first, last);
  const auto key = [&](int32_t i) { return xyz[3 * i + axis]; };
  // NaN comes after all numbers, since std::nth_element needs a strict order.
  const auto before = [&](int32_t a, int32_t b) {
    const T x = key(a), y = key(b);
    if (x != x || y != y) return x == x ? true : (y == y ? false : a < b);
    return x < y || (x == y && a < b);
  };
  std::nth_element(first, middle, last, before);
  sort_into_tiles(xyz, first, middle, size, group);
  sort_into_tiles(xyz, middle, last, size, group);
}

template void sort_into_tiles<float>(const float*, int32_t*, int32_t*, int64_t, int64_t);
template void sort_into_tiles<double>(const double*, int32_t*, int32_t*, int64_t, int64_t);

}  // namespace restage
