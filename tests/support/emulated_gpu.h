// The GPU's kernels (autograd/cuda), compiled for the host: what they compute is tested where there
// is no GPU. How fast, and what CUDA itself says to them, is not.
#pragma once

#include "tests/support/guarded_backend.h"

namespace restage {

/// The device "emulated gpu", entered on the first call.
Device emulated_gpu();
DeviceCounts emulated_counts();

}  // namespace restage
