// Memory for the time of a kernel, from the pool.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

#include "autograd/cpu/pool.h"

namespace restage::cpu {

/// `count` numbers, not initialised, aligned to cache lines.
template <class T>
class Workspace {
 public:
  explicit Workspace(int64_t count)
      : bytes_(static_cast<size_t>(count) * sizeof(T)),
        data_(count > 0 ? static_cast<T*>(pool_allocate(bytes_)) : nullptr) {}
  ~Workspace() {
    if (data_ != nullptr) pool_release(data_, bytes_);
  }
  Workspace(const Workspace&) = delete;
  Workspace& operator=(const Workspace&) = delete;
  T* data() const { return data_; }
  void swap(Workspace& other) {
    std::swap(bytes_, other.bytes_);
    std::swap(data_, other.data_);
  }

 private:
  size_t bytes_;
  T* data_;
};

}  // namespace restage::cpu
