// Sums over the middle axis of [outer, n, inner], in double, in an order that sizes decide.
#pragma once

#include "autograd/cuda/device_code.h"

namespace restage::cuda {

/// out[o, i] = sum of f(o, r, i) over r below n. Few rows: a thread adds up a column. One column: a
/// group of threads does. Many rows of many columns: threads beside each other read numbers beside
/// each other, in parts of the rows that are added up at the end.
template <class F>
void sums(const Tensor& like, int64_t outer, int64_t n, int64_t inner, double* out, F f) {
  constexpr int64_t kPart = 256;
  const int64_t parts = (n + kPart - 1) / kPart;
  if (inner == 1 && n > 64) {
    groups(outer, [=] RESTAGE_DEVICE(const Group& g, int64_t o) {
      const double total = g.sum(n, [&](int64_t r) { return f(o, r, int64_t{0}); });
      g.each(1, [&](int64_t) { out[o] = total; });
    });
    return;
  }
  if (parts <= 1) {
    each(outer * inner, [=] RESTAGE_DEVICE(int64_t k) {
      double total = 0;
      for (int64_t r = 0; r < n; ++r) total += f(k / inner, r, k % inner);
      out[k] = total;
    });
    return;
  }
  Tensor partial = scratch(like, outer * parts * inner);
  double* part = at<double>(partial);
  each(outer * parts * inner, [=] RESTAGE_DEVICE(int64_t k) {
    const int64_t o = k / (parts * inner), p = k / inner % parts, i = k % inner;
    const int64_t end = n < (p + 1) * kPart ? n : (p + 1) * kPart;
    double total = 0;
    for (int64_t r = p * kPart; r < end; ++r) total += f(o, r, i);
    part[k] = total;
  });
  each(outer * inner, [=] RESTAGE_DEVICE(int64_t k) {
    double total = 0;
    for (int64_t p = 0; p < parts; ++p) total += part[(k / inner * parts + p) * inner + k % inner];
    out[k] = total;
  });
}

}  // namespace restage::cuda
