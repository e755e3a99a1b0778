#include "autograd/cpu/attention_tiles.h"

#include <algorithm>
#include <array>
#include <numeric>

namespace restage::cpu {
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
    side[static_cast<size_t>(c)] = hi - lo;
  }
  return static_cast<int>(std::max_element(side.begin(), side.end()) - side.begin());
}

/// Whole tiles go left, so that all but the last of a cloud are full.
template <class T>
void cut(const T* xyz, int32_t* first, int32_t* last, int64_t size) {
  const int64_t count = last - first;
  if (count <= size) {
    std::sort(first, last);
    return;
  }
  const int64_t tiles = (count + size - 1) / size;
  int32_t* middle = first + (tiles + 1) / 2 * size;
  const int axis = longest_side(xyz, first, last);
  const auto key = [&](int32_t i) { return xyz[3 * i + axis]; };
  // NaN after all numbers: the order must be one.
  const auto before = [&](int32_t a, int32_t b) {
    const T x = key(a), y = key(b);
    if (x != x || y != y) return x == x ? true : (y == y ? false : a < b);
    return x < y || (x == y && a < b);
  };
  if (middle < last) std::nth_element(first, middle, last, before);
  cut(xyz, first, std::min(middle, last), size);
  if (middle < last) cut(xyz, middle, last, size);
}

}  // namespace

template <class T>
PointTiles tile_points(const T* xyz, int64_t n, int64_t v, int64_t size) {
  PointTiles out;
  out.order.resize(static_cast<size_t>(n * v));
  std::iota(out.order.begin(), out.order.end(), 0);
  for (int64_t c = 0; c < n; ++c) {
    if (v > 0) cut(xyz, out.order.data() + c * v, out.order.data() + (c + 1) * v, size);
    for (int64_t i = 0; i < v; i += size) out.start.push_back(c * v + i);
  }
  out.start.push_back(n * v);
  return out;
}

template PointTiles tile_points<float>(const float*, int64_t, int64_t, int64_t);
template PointTiles tile_points<double>(const double*, int64_t, int64_t, int64_t);

}  // namespace restage::cpu
