// Memory of a second device without a device. A tensor's address lies in a range without any
// rights, so who reads or writes it in passing, or keeps a pointer from a kernel, faults at that
// line; only while a kernel runs does Tensor::data() lead to the numbers, which are elsewhere. All
// of it is NaN until it is written.
#pragma once

#include <cstddef>
#include <map>
#include <mutex>
#include <vector>

#include "autograd/kernels/kernel.h"

namespace restage {

/// What such a device has done since the program began.
struct DeviceCounts {
  int64_t kernels = 0;
  int64_t waits = 0;  ///< times that the host waited for it: copies to the host, synchronise()
};

class GuardedBackend : public Backend {
 public:
  explicit GuardedBackend(std::string_view name);

  std::string_view name() const override { return name_; }
  void* allocate(size_t bytes) override;
  void release(void* data, size_t bytes) override;
  void fill_zero(void* data, size_t bytes) override;
  void copy_in(void* to, const void* from, size_t bytes) override;
  void copy(void* to, const void* from, size_t bytes) override;
  void copy_out(void* to, const void* from, size_t bytes) override;
  /// Throws what the kernels since the last call found wrong.
  void synchronise() override;
  void run(std::type_index args_type, const void* args) override;
  MemoryStats memory() const override;
  void reset_peak() override;
  /// Forgets the free blocks; their addresses are not used again.
  void trim() override;

  Device device() const { return device_; }
  DeviceCounts counts;

 protected:
  /// Runs a kernel; data() leads to the numbers.
  virtual void run_kernel(std::type_index args_type, const void* args) = 0;
  /// What kernels since the last call found wrong, empty if nothing.
  virtual std::string take_fault() = 0;
  void run_own(std::type_index args_type, const void* args) { Backend::run(args_type, args); }

 private:
  std::byte* there(const void* data) const;

  std::string_view name_;
  std::byte *addresses_, *numbers_;
  Device device_;
  size_t used_ = 0;
  mutable std::mutex mutex_;
  MemoryStats stats_;
  std::map<size_t, std::vector<std::byte*>> free_;
};

}  // namespace restage
