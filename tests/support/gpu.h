// The GPU, where there is one and the program is built for it.
#pragma once

#include <gtest/gtest.h>

#include "autograd/base/error.h"
#include "autograd/kernels/kernel.h"

/// Gives the device "cuda", or skips the test and says why.
#define RESTAGE_GPU_OR_SKIP(device)   \
  Device device;                      \
  try {                               \
    device = device_of("cuda");       \
  } catch (const InputError& error) { \
    GTEST_SKIP() << error.what();     \
  }
