// Instruction sets. A kernel file is compiled once for each of AVX-512, AVX2 and plain x86-64 (or
// the processor's own baseline elsewhere), and the processor decides at run time which is called.
// The form of such a file, from Highway:
//
//     #undef HWY_TARGET_INCLUDE
//     #define HWY_TARGET_INCLUDE "autograd/cpu/this_file.cpp"
//     #include <hwy/foreach_target.h>  // includes this file again for every set
//     #include "autograd/cpu/targets.h"
//     ...
//     HWY_BEFORE_NAMESPACE();
//     namespace restage::cpu::HWY_NAMESPACE {
//     void kernel(const KernelArgs& args) { ... }   // lambdas with loops: [&](...) HWY_ATTR {...}
//     }
//     HWY_AFTER_NAMESPACE();
//     #if HWY_ONCE
//     namespace restage::cpu {
//     RESTAGE_KERNEL(kernel, KernelArgs)
//     }
//     #endif
//
// Only code between BEFORE and AFTER may use what the set has; Eigen's and the standard library's
// functions are compiled for the baseline, wherever they are called from. AVX2 and AVX-512 give the
// same bits: every sum has an order of its own, written down, whatever the width of a vector.
#include <hwy/highway.h>  // outside the guard: it sets the current instruction set anew each time

#ifndef RESTAGE_CPU_TARGETS_H
#define RESTAGE_CPU_TARGETS_H

/// The function that the backend's table holds: calls the variant for this processor.
#define RESTAGE_KERNEL(kernel, Args) \
  HWY_EXPORT(kernel);                \
  void kernel(const Args& args) { HWY_DYNAMIC_DISPATCH(kernel)(args); }

#endif
