// Intel's matrix unit (AMX): tiles of 16 rows of 64 bytes, and one instruction that multiplies two
// of them, 16 x 32 and 32 x 16 numbers in bfloat16, and adds to 16 x 16 in float32.
#pragma once

#include <cstdint>

namespace restage::cpu {

/// A thread uses the unit while this lives: tiles are configured, and given back afterwards, so
/// that a switch of threads need not save them. Does nothing unless `use`.
class AmxScope {
 public:
  explicit AmxScope(bool use);
  ~AmxScope();
  AmxScope(const AmxScope&) = delete;
  AmxScope& operator=(const AmxScope&) = delete;

 private:
  bool use_;
};

/// sums [32, 32] = a b over `steps` of 32 terms, packed as matmul_bf16.cpp says, or += if add.
/// Inside an AmxScope.
void amx_multiply(int64_t steps, const uint32_t* a, const uint32_t* b, bool add, float* sums);

}  // namespace restage::cpu
