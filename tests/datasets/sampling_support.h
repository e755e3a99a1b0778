// What the tests of samplers share: the corpus that they draw from, and numbers out of tensors.
#pragma once

#include <cstring>

#include "autograd/tensor/tensor.h"
#include "tests/support/tiny_body.h"

namespace restage::testing {

inline const Corpus& training_corpus() {
  static const Corpus corpus = subset(tiny_corpus(), "train");
  return corpus;
}

inline bool same_bits(const Tensor& a, const Tensor& b) {
  return a.shape() == b.shape() &&
         std::memcmp(a.bytes(), b.bytes(), static_cast<size_t>(a.numel()) * sizeof(float)) == 0;
}

/// Three numbers from position 3 i of row `row`.
inline Vec3 at(const Tensor& x, int64_t row, int64_t i) {
  const float* p = x.data<float>() + row * (x.numel() / x.size(0)) + 3 * i;
  return Vec3(p[0], p[1], p[2]);
}

}  // namespace restage::testing
