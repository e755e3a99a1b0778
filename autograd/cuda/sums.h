// Sums over the middle axis of [outer, n, inner], in an order that sizes decide. S is what is added
// up: double, Sums or Largest.
#pragma once

#include "autograd/cuda/device_code.h"

namespace restage::cuda {

/// How n rows are cut into parts. Threads beside each other read columns beside each other; where
/// there are few columns, a group of threads shares one.
struct RowsOfASum {
  RowsOfASum(int64_t outer, int64_t n, int64_t inner) : by_group(inner < 32 && n > 64) {
    constexpr int64_t kEnoughThreads = 1 << 16, kByGroup = 1 << 14, kLeast = 16;
    length = by_group ? kByGroup : std::max(kLeast, outer * n * inner / kEnoughThreads);
    parts = std::max<int64_t>(1, (n + length - 1) / length);
  }
  bool by_group;
  int64_t length, parts;
};

/// write((o * parts + p) * inner + i, sum of f(o, r, i) over the rows r of part p).
template <class S = double, class F, class Write>
void sum_parts(int64_t outer, int64_t n, int64_t inner, const RowsOfASum& cut, F f, Write write) {
  const int64_t parts = cut.parts, length = cut.length;
  if (cut.by_group) {
    groups(outer * parts * inner, [=] RESTAGE_DEVICE(const Group& g, int64_t k) {
      const int64_t o = k / (parts * inner), first = k / inner % parts * length, i = k % inner,
                    count = n - first < length ? n - first : length;
      const S total = g.sum<S>(count, [&](int64_t r) { return f(o, first + r, i); });
      g.each(1, [&](int64_t) { write(k, total); });
    });
    return;
  }
  each(outer * parts * inner, [=] RESTAGE_DEVICE(int64_t k) {
    const int64_t o = k / (parts * inner), first = k / inner % parts * length, i = k % inner,
                  end = n - first < length ? n : first + length;
    S total{};
    for (int64_t r = first; r < end; ++r) total += f(o, r, i);
    write(k, total);
  });
}

/// write(o * inner + i, sum of f(o, r, i) over r below n). The parts of long sums are added up at
/// the end.
template <class S = double, class F, class Write>
void sums(const Tensor& like, int64_t outer, int64_t n, int64_t inner, F f, Write write) {
  RowsOfASum cut(outer, n, inner);
  if (cut.parts == 1) return sum_parts<S>(outer, n, inner, cut, f, write);
  const int64_t parts = cut.parts;
  constexpr int64_t kDoubles = sizeof(S) / sizeof(double);
  Tensor partial = scratch(like, outer * parts * inner * kDoubles);
  S* part = reinterpret_cast<S*>(at<double>(partial));
  sum_parts<S>(outer, n, inner, cut, f,
               [=] RESTAGE_DEVICE(int64_t k, const S& total) { part[k] = total; });
  cut.by_group = parts > 64;
  cut.length = parts;
  cut.parts = 1;
  sum_parts<S>(
      outer, parts, inner, cut,
      [=] RESTAGE_DEVICE(int64_t o, int64_t p, int64_t i) {
        return part[(o * parts + p) * inner + i];
      },
      write);
}

/// The sums themselves.
template <class F>
void sums(const Tensor& like, int64_t outer, int64_t n, int64_t inner, double* out, F f) {
  sums(like, outer, n, inner, f, [=] RESTAGE_DEVICE(int64_t k, double total) { out[k] = total; });
}

}  // namespace restage::cuda
