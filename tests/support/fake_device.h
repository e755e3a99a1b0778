// A second device without a device: the CPU's kernels behind memory that nobody else may touch. A
// tensor's address there lies in a range without any rights, so who reads or writes it in passing, or
// keeps a pointer from a kernel, faults at that line; only while a kernel runs does data() lead to
// the numbers, which are elsewhere. Whatever works here touches a device only through its backend.
#pragma once

#include <initializer_list>
#include <typeindex>

#include "autograd/kernels/kernel.h"

namespace restage {

/// The device "fake", entered on the first call. All its memory is NaN until it is written.
Device fake_device();

/// While one lives, the fake device has no kernels for these contracts.
class WithoutKernels {
 public:
  WithoutKernels(std::initializer_list<std::type_index> contracts);
  ~WithoutKernels();
  WithoutKernels(const WithoutKernels&) = delete;
  WithoutKernels& operator=(const WithoutKernels&) = delete;
};

/// What the fake device has done since the program began.
struct FakeCounts {
  int64_t kernels = 0;
  int64_t waits = 0;  ///< times that the host waited for it: copies to the host, synchronise()
};
FakeCounts fake_counts();

}  // namespace restage
