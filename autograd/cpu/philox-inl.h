// The numbers of base/rng.h's philox(), several counters at a time.
#if defined(RESTAGE_CPU_PHILOX_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef RESTAGE_CPU_PHILOX_INL_H
#undef RESTAGE_CPU_PHILOX_INL_H
#else
#define RESTAGE_CPU_PHILOX_INL_H
#endif

#include <bit>
#include <cstdint>

#include "autograd/base/rng.h"
#include "autograd/cpu/targets.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

static_assert(std::endian::native == std::endian::little);

/// words[4 * i + j] = philox(key, first + i)[j] for i < count; count is a multiple of 8.
HWY_INLINE void philox_words(const RngKey& key, uint64_t first, int64_t count, uint32_t* words) {
#if HWY_TARGET == HWY_SCALAR
  for (int64_t i = 0; i < count; ++i) {
    const auto w = philox(key, first + static_cast<uint64_t>(i));
    for (size_t j = 0; j < 4; ++j) words[4 * i + static_cast<int64_t>(j)] = w[j];
  }
#else
  // A lane of 64 bits holds one 32-bit word in its lower half; MulEven reads no more than that, so
  // what the upper halves hold does not matter until the end.
  const hn::CappedTag<uint64_t, 8> d;
  const hn::Repartition<uint32_t, decltype(d)> d32;
  using V = hn::Vec<decltype(d)>;
  const auto times = [&](V a, uint32_t b)
                         HWY_ATTR { return hn::MulEven(hn::BitCast(d32, a), hn::Set(d32, b)); };
  const V low = hn::Set(d, 0xffffffffull);
  const auto width = static_cast<int64_t>(hn::Lanes(d));
  for (int64_t i = 0; i < count; i += width) {
    V c0 = hn::Iota(d, first + static_cast<uint64_t>(i)), c1 = hn::ShiftRight<32>(c0);
    V c2 = hn::Set(d, key.stream), c3 = hn::ShiftRight<32>(c2);
    auto k0 = static_cast<uint32_t>(key.seed), k1 = static_cast<uint32_t>(key.seed >> 32);
    for (int round = 0; round < 10; ++round) {
      const V p0 = times(c0, 0xD2511F53u), p1 = times(c2, 0xCD9E8D57u);
      c0 = hn::Xor(hn::Xor(hn::ShiftRight<32>(p1), c1), hn::Set(d, uint64_t{k0}));
      c2 = hn::Xor(hn::Xor(hn::ShiftRight<32>(p0), c3), hn::Set(d, uint64_t{k1}));
      c1 = p1;
      c3 = p0;
      k0 += 0x9E3779B9u;
      k1 += 0xBB67AE85u;
    }
    const V w01 = hn::Or(hn::And(c0, low), hn::ShiftLeft<32>(c1));
    const V w23 = hn::Or(hn::And(c2, low), hn::ShiftLeft<32>(c3));
    hn::StoreInterleaved2(w01, w23, d, reinterpret_cast<uint64_t*>(words + 4 * i));
  }
#endif
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per target
