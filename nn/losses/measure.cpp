#include "nn/losses/measure.h"

#include <cmath>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"

namespace restage {

Var errors(const Var& x, Measure measure, int64_t width) {
  if (measure == Measure::mse) return square(x);
  const Var rows = reshape(x, {x.size(0), x.value.numel() / (x.size(0) * width), width});
  return smooth_length(rows, 1e-10);
}

double mean_distance(const Tensor& a, const Tensor& b) {
  double total = 0;
  const int64_t rows = a.numel() / 3;
  for (int64_t i = 0; i < rows; ++i) {
    double d2 = 0;
    for (int64_t c = 0; c < 3; ++c) {
      const double d = a.item(3 * i + c) - b.item(3 * i + c);
      d2 += d * d;
    }
    total += std::sqrt(d2);
  }
  return total / static_cast<double>(rows);
}

}  // namespace restage
