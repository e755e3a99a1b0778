// Subnormal numbers, below 1.2e-38 in float32, make a processor's products many times slower.
#pragma once

#include <hwy/detect_targets.h>

#if HWY_ARCH_X86
#include <xmmintrin.h>
#endif

namespace restage::cpu {

/// While it lives, its thread takes them for zero, in what it reads and in what it writes (x86;
/// elsewhere nothing changes). For the inside of a piece of parallel work: what other threads do
/// depends on them alone, so around parallel_for() bits would depend on who did what.
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
