// Shows, in tests, results that a kernel leaves unwritten.
#pragma once

namespace restage {

/// While one is alive, memory for new tensors and for kernels' work is full of NaN (every byte is
/// 0xff), whatever its size.
struct NanMemory {
  NanMemory();
  ~NanMemory();
  NanMemory(const NanMemory&) = delete;
  NanMemory& operator=(const NanMemory&) = delete;
};

}  // namespace restage
