#include <cub/device/device_radix_sort.cuh>

#include "autograd/cuda/indices.h"

namespace restage::cuda {

void sort_by_key(Tensor& keys, Tensor& values, int64_t limit) {
  if (keys.numel() == 0) return;
  Tensor sorted = empty_like(keys), moved = empty_like(values);
  int bits = 1;
  while ((limit - 1) >> bits > 0) ++bits;
  size_t bytes = 0;
  const auto sort = [&](void* room) {
    check(cub::DeviceRadixSort::SortPairs(room, bytes, at<int32_t>(keys), at<int32_t>(sorted),
                                          at<int32_t>(values), at<int32_t>(moved), keys.numel(), 0,
                                          bits, stream()),
          "a sort");
  };
  sort(nullptr);  // asks for the size of its room
  const Tensor room = scratch(keys, static_cast<int64_t>(bytes / sizeof(double)) + 1);
  sort(at<double>(room));
  keys = sorted;
  values = moved;
}

}  // namespace restage::cuda
