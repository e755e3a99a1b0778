// Tiles of neighbouring points, for kernels that gain when a tile's inputs are alike.
#pragma once

#include <cstdint>
#include <vector>

namespace restage::cpu {

struct PointTiles {
  std::vector<int32_t> order;  ///< rows of xyz, tile after tile, cloud after cloud
  std::vector<int64_t> start;  ///< of each tile in `order`, and the end
  int64_t tiles() const { return static_cast<int64_t>(start.size()) - 1; }
};

/// Cuts each of n clouds of v points at medians of its longest side until a piece has at most
/// `size` points. The result depends on the coordinates alone; ties go to the lower index.
template <class T>
PointTiles tile_points(const T* xyz, int64_t n, int64_t v, int64_t size);

extern template PointTiles tile_points<float>(const float*, int64_t, int64_t, int64_t);
extern template PointTiles tile_points<double>(const double*, int64_t, int64_t, int64_t);

}  // namespace restage::cpu
