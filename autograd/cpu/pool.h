// Pooled host memory: blocks are kept by size class and reused, so a steady training step takes
// nothing new from the system (fresh pages cost more than the arithmetic on them).
#pragma once

#include <cstddef>

namespace restage::cpu {

void* pool_allocate(size_t bytes);
void pool_release(void* data, size_t bytes);

}  // namespace restage::cpu
