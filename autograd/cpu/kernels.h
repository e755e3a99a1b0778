// The kernels of the CPU; backend.cpp enters them into the table.
#pragma once

#include "autograd/kernels/list.h"

namespace restage::cpu {

#define RESTAGE_DECLARE(kernel, Args) void kernel(const Args&);
RESTAGE_KERNELS(RESTAGE_DECLARE)
#undef RESTAGE_DECLARE

}  // namespace restage::cpu
