// The kernels of the GPU; backend.cu enters them into the table.
#pragma once

#include <string>

#include "autograd/cuda/device_code.h"
#include "autograd/kernels/list.h"

namespace restage::cuda {

#define RESTAGE_DECLARE(kernel, Args) void kernel(const Args&);
RESTAGE_KERNELS(RESTAGE_DECLARE)
#undef RESTAGE_DECLARE

/// What a kernel found wrong with an index since the last call, empty if nothing. It waits.
std::string take_index_fault();

}  // namespace restage::cuda
