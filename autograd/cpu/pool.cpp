#include "autograd/cpu/pool.h"

#include <sys/mman.h>

#include <bit>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <mutex>
#include <new>
#include <vector>

#include "autograd/tensor/tensor.h"

// Under AddressSanitizer free blocks, and the slack behind a tensor, may not be touched.
#ifdef __has_feature
#if __has_feature(address_sanitizer)
#define __SANITIZE_ADDRESS__  // as GCC calls it
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

struct Pool {
  std::mutex mutex;
  std::map<size_t, std::vector<void*>> free;
  MemoryStats stats;
};

Pool& pool() {
  static Pool* instance = new Pool;  // never destroyed: tensors of static lifetime may outlive it
  return *instance;
}

/// Size classes: eight steps per power of two, so at most an eighth is wasted.
size_t size_class(size_t bytes) {
  if (bytes <= kAlign) return kAlign;
  const size_t step = std::max(kAlign, std::bit_floor(bytes) / 8);
  return (bytes + step - 1) / step * step;
}

void* from_system(size_t bytes) {
  const size_t align = bytes >= kHuge ? kHuge : kAlign;
  void* data = std::aligned_alloc(align, (bytes + align - 1) / align * align);
  if (data == nullptr) throw std::bad_alloc();
  if (bytes >= kHuge) ::madvise(data, bytes, MADV_HUGEPAGE);
  return data;
}

}  // namespace

void* cpu::pool_allocate(size_t bytes) {
  const size_t size = size_class(bytes);
  Pool& p = pool();
  const std::lock_guard lock(p.mutex);
  auto& list = p.free[size];
  void* data = nullptr;
  if (list.empty()) {
    data = from_system(size);
    if (size >= kLarge) ++p.stats.large_allocations;
  } else {
    data = list.back();
    list.pop_back();
  }
  p.stats.in_use += static_cast<int64_t>(size);
  p.stats.peak = std::max(p.stats.peak, p.stats.in_use);
  ASAN_POISON_MEMORY_REGION(data, size);
  ASAN_UNPOISON_MEMORY_REGION(data, bytes);
  return data;
}

void cpu::pool_release(void* data, size_t bytes) {
  const size_t size = size_class(bytes);
  Pool& p = pool();
  const std::lock_guard lock(p.mutex);
  p.stats.in_use -= static_cast<int64_t>(size);
  p.free[size].push_back(data);
  ASAN_POISON_MEMORY_REGION(data, size);
}

MemoryStats memory_stats() {
  Pool& p = pool();
  const std::lock_guard lock(p.mutex);
  return p.stats;
}

void reset_peak_memory() {
  Pool& p = pool();
  const std::lock_guard lock(p.mutex);
  p.stats.peak = p.stats.in_use;
}

}  // namespace restage
