// Counter-based random numbers: every draw is a pure function of (seed, stream, index), so results
// do not depend on threads, call order or platform. Philox 4x32-10 (Salmon et al., SC 2011).
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace restage {

/// Names one independent stream of numbers.
struct RngKey {
  uint64_t seed = 0;
  uint64_t stream = 0;
  /// A sub-stream, e.g. one per step, per sample or per layer.
  RngKey fold(uint64_t value) const;
  RngKey fold(std::string_view name) const;
};

/// Four 32-bit words number `index` of a stream.
std::array<uint32_t, 4> philox(const RngKey& key, uint64_t index);

/// Uniform in [0, 1): 53 (double) bits of draw number `index`.
double uniform(const RngKey& key, uint64_t index);
/// Standard normal (Box-Muller) number `index`.
double normal(const RngKey& key, uint64_t index);
/// Uniform integer in [0, n), n > 0.
uint64_t uniform_int(const RngKey& key, uint64_t index, uint64_t n);

/// A cursor over one stream, for code that draws one number after the other.
class Rng {
 public:
  explicit Rng(RngKey key) : key_(key) {}
  double uniform() { return restage::uniform(key_, next_++); }
  double uniform(double lo, double hi) { return lo + (hi - lo) * uniform(); }
  double normal() { return restage::normal(key_, next_++); }
  uint64_t below(uint64_t n) { return uniform_int(key_, next_++, n); }
  const RngKey& key() const { return key_; }

 private:
  RngKey key_;
  uint64_t next_ = 0;
};

}  // namespace restage
