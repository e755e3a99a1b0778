// A second device with the CPU's kernels: whatever gives the CPU's bits on it touches a device only
// through its backend.
#pragma once

#include <initializer_list>
#include <typeindex>

#include "tests/support/guarded_backend.h"

namespace restage {

/// The device "fake", entered on the first call.
Device fake_device();
DeviceCounts fake_counts();

/// While one lives, the fake device has no kernels for these contracts.
class WithoutKernels {
 public:
  WithoutKernels(std::initializer_list<std::type_index> contracts);
  ~WithoutKernels();
  WithoutKernels(const WithoutKernels&) = delete;
  WithoutKernels& operator=(const WithoutKernels&) = delete;
};

}  // namespace restage
