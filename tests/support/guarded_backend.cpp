#include "tests/support/guarded_backend.h"

#include <sys/mman.h>

#include <bit>
#include <cstring>
#include <new>
#include <string>

#include "autograd/base/error.h"
#include "autograd/tensor/host_view.h"

namespace restage {
namespace {

constexpr size_t kRange = size_t{16} << 30,
                 kAlign = 64;  // reserved; what is not used costs nothing

std::byte* reserve(int rights) {
  void* range = ::mmap(nullptr, kRange, rights, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (range == MAP_FAILED) throw Error("a guarded device finds no room for its addresses");
  return static_cast<std::byte*>(range);
}

size_t block_of(size_t bytes) { return std::bit_ceil(std::max(bytes, kAlign)); }

}  // namespace

GuardedBackend::GuardedBackend(std::string_view name)
    : name_(name),
      addresses_(reserve(PROT_NONE)),
      numbers_(reserve(PROT_READ | PROT_WRITE)),
      device_(add_device(*this)) {}

std::byte* GuardedBackend::there(const void* data) const {
  return numbers_ + (static_cast<const std::byte*>(data) - addresses_);
}

void* GuardedBackend::allocate(size_t bytes) {
  const std::lock_guard lock(mutex_);
  std::vector<std::byte*>& spare = free_[block_of(bytes)];
  std::byte* data = nullptr;
  if (!spare.empty()) {
    data = spare.back();
    spare.pop_back();
    stats_.kept -= static_cast<int64_t>(block_of(bytes));
  } else {
    if (kRange - used_ < block_of(bytes)) throw std::bad_alloc();
    data = addresses_ + used_;
    used_ += block_of(bytes);
  }
  stats_.in_use += static_cast<int64_t>(block_of(bytes));
  stats_.peak = std::max(stats_.peak, stats_.in_use);
  std::memset(there(data), 0xff, bytes);
  return data;
}

void GuardedBackend::release(void* data, size_t bytes) {
  const std::lock_guard lock(mutex_);
  stats_.in_use -= static_cast<int64_t>(block_of(bytes));
  stats_.kept += static_cast<int64_t>(block_of(bytes));
  free_[block_of(bytes)].push_back(static_cast<std::byte*>(data));
}

void GuardedBackend::fill_zero(void* data, size_t bytes) { std::memset(there(data), 0, bytes); }
void GuardedBackend::copy_in(void* to, const void* from, size_t bytes) {
  std::memcpy(there(to), from, bytes);
}
void GuardedBackend::copy(void* to, const void* from, size_t bytes) {
  std::memcpy(there(to), there(from), bytes);
}
void GuardedBackend::copy_out(void* to, const void* from, size_t bytes) {
  synchronise();
  std::memcpy(to, there(from), bytes);
}

void GuardedBackend::synchronise() {
  ++counts.waits;
  if (const std::string fault = take_fault(); !fault.empty()) throw Error(fault);
}

MemoryStats GuardedBackend::memory() const {
  const std::lock_guard lock(mutex_);
  return stats_;
}

void GuardedBackend::reset_peak() {
  const std::lock_guard lock(mutex_);
  stats_.peak = stats_.in_use;
}

void GuardedBackend::trim() {
  const std::lock_guard lock(mutex_);
  free_.clear();
  stats_.kept = 0;
}

void GuardedBackend::run(std::type_index args_type, const void* args) {
  ++counts.kernels;
  const HostView view(device_, numbers_ - addresses_);
  run_kernel(args_type, args);
}

}  // namespace restage
