// Pooled host memory: blocks are kept by size class and reused, so a steady training step takes
// nothing new from the system (fresh pages cost more than the arithmetic on them).
#pragma once

#include <cstddef>

#include "autograd/tensor/tensor.h"

namespace restage::cpu {

/// std::bad_alloc if the system has no more memory and no free block is left to give back to it.
void* pool_allocate(size_t bytes);
void pool_release(void* data, size_t bytes);
/// Gives all free blocks back to the system.
void pool_trim();
MemoryStats pool_stats();
void pool_reset_peak();

}  // namespace restage::cpu
