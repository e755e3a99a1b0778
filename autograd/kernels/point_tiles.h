// Tiles of neighbouring points, for kernels that gain when a tile's inputs are alike.
#pragma once

#include <cstdint>

namespace restage {

/// Sorts the indices [first, last) of points into tiles of `size`, all but the last of them full:
/// halved at the median of the longest side while there are several tiles; on whole groups of
/// tiles while there are several groups, so that a group's tiles are neighbours too. Depends on the
/// coordinates alone: ties go to the lower index, NaN comes after all numbers. In a tile the
/// indices ascend.
template <class T>
void sort_into_tiles(const T* xyz, int32_t* first, int32_t* last, int64_t size, int64_t group = 1);

extern template void sort_into_tiles<float>(const float*, int32_t*, int32_t*, int64_t, int64_t);
extern template void sort_into_tiles<double>(const double*, int32_t*, int32_t*, int64_t, int64_t);

}  // namespace restage
