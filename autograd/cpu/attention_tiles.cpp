#include "autograd/cpu/attention_tiles.h"

#include <numeric>

#include "autograd/kernels/point_tiles.h"

namespace restage::cpu {

template <class T>
PointTiles tile_points(const T* xyz, int64_t n, int64_t v, int64_t size) {
  PointTiles out;
  out.order.resize(n * v);
  std::iota(out.order.begin(), out.order.end(), 0);
  for (int64_t c = 0; c < n; ++c) {
    int32_t* cloud = out.order.data() + c * v;
    sort_into_tiles(xyz, cloud, cloud + v, size);
    for (int64_t i = 0; i < v; i += size) out.start.push_back(c * v + i);
  }
  out.start.push_back(n * v);
  return out;
}

template PointTiles tile_points<float>(const float*, int64_t, int64_t, int64_t);
template PointTiles tile_points<double>(const double*, int64_t, int64_t, int64_t);

}  // namespace restage::cpu
