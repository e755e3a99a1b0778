// Lists in memory of the host's pool: working memory of kernels, and the handles of tensors. So a
// loop that repeats itself takes nothing from the heap.
#pragma once

#include <vector>

#include "autograd/kernels/kernel.h"

namespace restage {

/// A standard allocator over the host's pool.
template <class T>
struct PoolAllocator {
  using value_type = T;
  PoolAllocator() = default;
  template <class U>
  PoolAllocator(const PoolAllocator<U>&) {}  // NOLINT: allocators convert
  T* allocate(size_t n) { return static_cast<T*>(backend(Device{}).allocate(n * sizeof(T))); }
  void deallocate(T* data, size_t n) { backend(Device{}).release(data, n * sizeof(T)); }
  bool operator==(const PoolAllocator&) const { return true; }
};

template <class T>
using Scratch = std::vector<T, PoolAllocator<T>>;

}  // namespace restage
