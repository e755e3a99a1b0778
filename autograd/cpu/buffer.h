// Memory for numbers, from the pool: for the time of a kernel, or kept by a thread (thread_local)
// where it grows to what was needed and stays. Lists of other things are Scratch
// (kernels/scratch.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

#include "autograd/cpu/pool.h"

namespace restage::cpu {

/// Not initialised, aligned to cache lines.
template <class T>
class Buffer {
 public:
  Buffer() = default;
  explicit Buffer(int64_t count) { at_least(count); }
  ~Buffer() { release(); }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  /// Room for `count` numbers; keeps nothing of what was there before.
  T* at_least(int64_t count) {
    if (count > size_) {
      release();
      data_ = static_cast<T*>(pool_allocate(static_cast<size_t>(count) * sizeof(T)));
      size_ = count;
    }
    return data_;
  }
  T* data() const { return data_; }
  void swap(Buffer& other) {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
  }

 private:
  void release() {
    if (data_ != nullptr) pool_release(data_, static_cast<size_t>(size_) * sizeof(T));
    data_ = nullptr;
    size_ = 0;
  }

  T* data_ = nullptr;
  int64_t size_ = 0;
};

}  // namespace restage::cpu
