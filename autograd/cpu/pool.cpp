#include "autograd/cpu/pool.h"

#include <malloc.h>
#include <sys/mman.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <new>
#include <vector>

#include "autograd/tensor/nan_memory.h"

// Under AddressSanitizer free blocks, and the slack behind a tensor, may not be touched.
#ifdef __has_feature
#if __has_feature(address_sanitizer)
#define __SANITIZE_ADDRESS__  // the name that GCC defines
#endif
#endif
#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/asan_interface.h>
#else
#define ASAN_POISON_MEMORY_REGION(data, bytes)
#define ASAN_UNPOISON_MEMORY_REGION(data, bytes)
#endif

namespace restage {
namespace {

constexpr size_t kAlign = 64;
constexpr size_t kLarge = size_t{1} << 20;
constexpr size_t kHuge = size_t{2} << 20;

// Size classes: eight steps per power of two (and steps of 64 bytes below 512), so at most an
// eighth is wasted.
struct SizeClass {
  size_t index, bytes;
};
constexpr size_t kClasses = 8 * 64;

SizeClass size_class(size_t bytes) {
  const size_t least = std::max(bytes, kAlign);
  const size_t step = std::max(kAlign, std::bit_floor(least) / 8);
  const size_t size = (least + step - 1) / step * step;  // may be the next power of two
  const size_t power = std::bit_floor(size), sub = std::max(kAlign, power / 8);
  return {8 * static_cast<size_t>(std::countr_zero(power)) + (size - power) / sub, size};
}

/// The free blocks of one size class.
struct FreeList {
  std::vector<void*> blocks;
  size_t taken = 0;  // from the system and not given back
};

struct Pool {
  std::mutex mutex;
  std::array<FreeList, kClasses> free;
  MemoryStats stats;
  int nan_memory = 0;  // how many NanMemory objects live
};

Pool& pool() {
  static Pool* instance = new Pool;  // never destroyed: tensors of static lifetime may outlive it
  return *instance;
}

/// Gives the free blocks back to the system; the caller holds the lock.
void trim(Pool& p) {
  for (FreeList& list : p.free) {
    for (void* data : list.blocks) std::free(data);
    list.taken -= list.blocks.size();
    list.blocks.clear();
  }
  p.stats.kept = 0;
#ifdef __GLIBC__
  ::malloc_trim(0);
#endif
}

/// The caller holds the pool's lock.
void* from_system(Pool& p, size_t bytes) {
  const size_t align = bytes >= kHuge ? kHuge : kAlign, whole = (bytes + align - 1) / align * align;
  void* data = std::aligned_alloc(align, whole);
  if (data == nullptr) {  // perhaps free blocks of other sizes hold the memory
    trim(p);
    data = std::aligned_alloc(align, whole);
  }
  if (data == nullptr) throw std::bad_alloc();
  if (bytes >= kHuge) ::madvise(data, bytes, MADV_HUGEPAGE);
  return data;
}

}  // namespace

NanMemory::NanMemory() {
  const std::lock_guard lock(pool().mutex);
  ++pool().nan_memory;
}

NanMemory::~NanMemory() {
  const std::lock_guard lock(pool().mutex);
  --pool().nan_memory;
}

void* cpu::pool_allocate(size_t bytes) {
  const auto [index, size] = size_class(bytes);
  Pool& p = pool();
  const std::lock_guard lock(p.mutex);
  FreeList& list = p.free[index];
  void* data = nullptr;
  if (list.blocks.empty()) {
    // There is always room for all blocks of a class, so that giving one back takes no memory.
    if (list.blocks.capacity() <= list.taken) list.blocks.reserve(2 * list.taken + 8);
    data = from_system(p, size);
    ++list.taken;
    if (size >= kLarge) ++p.stats.large_allocations;
  } else {
    data = list.blocks.back();
    list.blocks.pop_back();
    p.stats.kept -= static_cast<int64_t>(size);
  }
  p.stats.in_use += static_cast<int64_t>(size);
  p.stats.peak = std::max(p.stats.peak, p.stats.in_use);
  ASAN_POISON_MEMORY_REGION(data, size);
  ASAN_UNPOISON_MEMORY_REGION(data, bytes);
  if (p.nan_memory > 0) std::memset(data, 0xff, bytes);
  return data;
}

void cpu::pool_release(void* data, size_t bytes) {
  const auto [index, size] = size_class(bytes);
  Pool& p = pool();
  const std::lock_guard lock(p.mutex);
  p.stats.in_use -= static_cast<int64_t>(size);
  p.stats.kept += static_cast<int64_t>(size);
  p.free[index].blocks.push_back(data);
  ASAN_POISON_MEMORY_REGION(data, size);
}

void cpu::pool_trim() {
  Pool& p = pool();
  const std::lock_guard lock(p.mutex);
  trim(p);
}

MemoryStats cpu::pool_stats() {
  Pool& p = pool();
  const std::lock_guard lock(p.mutex);
  return p.stats;
}

void cpu::pool_reset_peak() {
  Pool& p = pool();
  const std::lock_guard lock(p.mutex);
  p.stats.peak = p.stats.in_use;
}

}  // namespace restage
