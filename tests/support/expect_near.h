#pragma once

#include <gtest/gtest.h>

#include <cmath>

#include "autograd/tensor/tensor.h"

namespace restage {

/// Equal shapes, and elements within `tolerance` of (1 + their size).
inline void expect_near(const Tensor& a, const Tensor& b, double tolerance,
                        const std::string& what) {
  ASSERT_EQ(a.shape(), b.shape()) << what;
  for (int64_t i = 0; i < a.numel(); ++i)
    ASSERT_NEAR(a.item(i), b.item(i), tolerance * (1 + std::abs(b.item(i)))) << what << " " << i;
}

}  // namespace restage
