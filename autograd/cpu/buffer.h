// Memory of a thread that grows to what was needed and stays.
#pragma once

#include "autograd/cpu/workspace.h"

namespace restage::cpu {

/// Aligned to cache lines. at_least() keeps nothing of what was there before.
template <class T>
class Buffer {
 public:
  T* at_least(int64_t count) {
    if (count > size_) {
      Workspace<T> larger(count);
      memory_.swap(larger);
      size_ = count;
    }
    return memory_.data();
  }
  T* data() { return memory_.data(); }
  const T* data() const { return memory_.data(); }

 private:
  Workspace<T> memory_{0};
  int64_t size_ = 0;
};

}  // namespace restage::cpu
