// Subnormal numbers, below 1.2e-38 in float32, make a processor's products many times slower.
#pragma once

#include <hwy/detect_targets.h>

#if HWY_ARCH_X86
#include <xmmintrin.h>
#endif

namespace restage::cpu {

/// While an object lives, its thread takes subnormal numbers for zero when it reads and when it
/// writes them (on x86; elsewhere nothing changes). To be used inside a piece of parallel work:
/// other threads have modes of their own, so around parallel_for() bits would depend on which
/// thread did what.
class FlushSubnormals {
 public:
#if HWY_ARCH_X86
  FlushSubnormals() : before_(_mm_getcsr()) { _mm_setcsr(before_ | 0x8040); }  // FTZ and DAZ
  ~FlushSubnormals() { _mm_setcsr(before_); }
#else
  FlushSubnormals() {}
  ~FlushSubnormals() {}
#endif
  FlushSubnormals(const FlushSubnormals&) = delete;
  FlushSubnormals& operator=(const FlushSubnormals&) = delete;

 private:
  [[maybe_unused]] unsigned before_ = 0;
};

}  // namespace restage::cpu
