#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "autograd/cpu/reduce.cpp"
#include <hwy/foreach_target.h>  // once per instruction set

#include <algorithm>

#include "autograd/cpu/common.h"
#include "autograd/cpu/kernels.h"
#include "autograd/cpu/math-inl.h"
#include "autograd/cpu/targets.h"
#include "autograd/kernels/scratch.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {
namespace {

constexpr int64_t kPart = 512;     // terms per partial sum
constexpr int64_t kColumns = 128;  // summed side by side

/// Columns [from, to) of a row of [outer, n, inner].
struct Columns {
  int64_t from, to;
  int64_t count() const { return to - from; }
};

/// Calls f(o, columns) for all columns of every outer row of [outer, n, inner]: several rows, or a
/// part of one, per piece.
template <class F>
void for_columns(int64_t outer, int64_t n, int64_t inner, F&& f) {
  const int64_t blocks = std::max<int64_t>(1, row_grain(n) / kColumns), width = blocks * kColumns;
  const int64_t pieces = (inner + width - 1) / width;
  parallel_for(outer * pieces, row_grain(n * std::min(inner, width)),
               [&](int64_t from, int64_t to) HWY_ATTR {
                 for (int64_t t = from; t < to; ++t) {
                   const int64_t i = t % pieces * width;
                   f(t / pieces, Columns{i, std::min(inner, i + width)});
                 }
               });
}

/// Sums the columns of x [n, inner] into `out` (overwritten). In double, since what is summed
/// (gradients of a bias) may all but cancel; a single column in the order of sum_of().
template <class T>
void sum_columns(const T* x, int64_t n, int64_t inner, Columns columns, T* out) {
  if (inner == 1) {
    *out = static_cast<T>(sum_of(
        n, [](auto v) HWY_ATTR { return v; }, x));
    return;
  }
  double total[kColumns];
  for (int64_t i0 = columns.from; i0 < columns.to; i0 += kColumns) {
    const int64_t count = std::min(kColumns, columns.to - i0);
    std::fill_n(total, count, 0.0);
    for (int64_t r = 0; r < n; ++r) {
      const T* row = x + r * inner + i0;
      for (int64_t i = 0; i < count; ++i) total[i] += static_cast<double>(row[i]);
    }
    for (int64_t i = 0; i < count; ++i) out[i0 + i] = static_cast<T>(total[i]);
  }
}

template <class T>
void sum_typed(const SumArgs& args) {
  const T* x = args.x.data<T>();
  T* out = args.out.data<T>();
  const int64_t n = args.n, inner = args.inner;
  const int64_t parts = std::max<int64_t>(1, (n + kPart - 1) / kPart);
  const auto sum_rows = [&](const T* from, int64_t rows, T* to) HWY_ATTR {
    for_columns(args.outer, rows, inner, [&](int64_t o, Columns columns) HWY_ATTR {
      sum_columns(from + o * rows * inner, rows, inner, columns, to + o * inner);
    });
  };
  if (parts == 1) return sum_rows(x, n, out);
  Tensor scratch = empty_like(args.out, {args.outer, parts, inner});
  T* partial = scratch.data<T>();
  for_columns(args.outer * parts, kPart, inner, [&](int64_t t, Columns columns) HWY_ATTR {
    const int64_t o = t / parts, first = t % parts * kPart;
    sum_columns(x + (o * n + first) * inner, std::min(n - first, kPart), inner, columns,
                partial + t * inner);
  });
  sum_rows(partial, parts, out);
}

/// Calls f(o) for every outer row, several per piece.
template <class F>
void for_rows(int64_t outer, int64_t row_size, F&& f) {
  parallel_for(outer, row_grain(row_size), [&](int64_t from, int64_t to) HWY_ATTR {
    for (int64_t o = from; o < to; ++o) f(o);
  });
}

template <class T>
void softmax_row(const T* x, int64_t n, T* y) {
  if (n == 0) return;
  const hn::ScalableTag<T> d;
  using V = hn::Vec<decltype(d)>;
  const V top = hn::Set(d, max_of(n, x));
  map(
      n, y, [&](V v) HWY_ATTR { return exp(hn::Sub(v, top)); }, x);
  const V total = hn::Set(d, static_cast<T>(sum_of(
                                 n, [](auto v) HWY_ATTR { return v; }, y)));
  map(
      n, y, [&](V v) HWY_ATTR { return hn::Div(v, total); }, y);
}

/// Along the rows of x [n, inner], for some columns.
template <class T>
void softmax_columns(const T* x, int64_t n, int64_t inner, Columns columns, T* y) {
  using V = hn::Vec<hn::ScalableTag<T>>;
  const int64_t count = columns.count();
  x += columns.from, y += columns.from;
  Scratch<T> tops(x, x + count), totals(static_cast<size_t>(count), T(0));
  T *top = tops.data(), *total = totals.data();
  for (int64_t r = 1; r < n; ++r)
    for (int64_t i = 0; i < count; ++i)
      top[i] = x[r * inner + i] > top[i] ? x[r * inner + i] : top[i];
  const auto exponential = [](V& out, V& sum, V v, V t) HWY_ATTR {
    out = exp(hn::Sub(v, t));
    sum = hn::Add(sum, out);
  };
  for (int64_t r = 0; r < n; ++r)
    update(count, exponential, y + r * inner, total, x + r * inner, static_cast<const T*>(top));
  for (int64_t r = 0; r < n; ++r)
    for (int64_t i = 0; i < count; ++i) y[r * inner + i] /= total[i];
}

}  // namespace

void sum(const SumArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR { sum_typed<decltype(zero)>(args); });
}

void max(const MaxArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR {
    using T = decltype(zero);
    const int64_t n = args.n, inner = args.inner;
    for_columns(args.outer, n, inner, [&](int64_t o, Columns columns) HWY_ATTR {
      const int64_t count = columns.count(), at_column = o * inner + columns.from;
      const T* x = args.x.data<T>() + o * n * inner + columns.from;
      T* best = args.out.data<T>() + at_column;
      int32_t* at = args.index.data<int32_t>() + at_column;
      std::copy_n(x, count, best);
      std::fill_n(at, count, 0);
      for (int64_t r = 1; r < n; ++r) {
        const T* row = x + r * inner;
        for (int64_t i = 0; i < count; ++i) {
          const bool better =
              row[i] > best[i] || (row[i] != row[i] && best[i] == best[i]);  // NaN wins
          best[i] = better ? row[i] : best[i];
          at[i] = better ? static_cast<int32_t>(r) : at[i];
        }
      }
    });
  });
}

void max_grad(const MaxGradArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR {
    using T = decltype(zero);
    const int64_t n = args.n, inner = args.inner;
    for_columns(args.outer, n, inner, [&](int64_t o, Columns columns) HWY_ATTR {
      T* out = args.out.data<T>() + o * n * inner;
      const T* gy = args.gy.data<T>() + o * inner;
      const int32_t* at = args.index.data<int32_t>() + o * inner;
      for (int64_t r = 0; r < n; ++r)
        std::fill_n(out + r * inner + columns.from, columns.count(), T(0));
      for (int64_t i = columns.from; i < columns.to; ++i) out[at[i] * inner + i] = gy[i];
    });
  });
}

void softmax(const SoftmaxArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR {
    using T = decltype(zero);
    const int64_t n = args.n, inner = args.inner;
    for_columns(args.outer, n, inner, [&](int64_t o, Columns columns) HWY_ATTR {
      const T* x = args.x.data<T>() + o * n * inner;
      T* y = args.out.data<T>() + o * n * inner;
      inner == 1 ? softmax_row(x, n, y) : softmax_columns(x, n, inner, columns, y);
    });
  });
}

void softmax_grad(const SoftmaxGradArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR {
    using T = decltype(zero);
    const int64_t n = args.n, inner = args.inner;
    for_columns(args.outer, n, inner, [&](int64_t o, Columns columns) HWY_ATTR {
      const T* y = args.y.data<T>() + o * n * inner + columns.from;
      const T* g = args.gy.data<T>() + o * n * inner + columns.from;
      T* out = args.out.data<T>() + o * n * inner + columns.from;
      if (inner == 1) {
        const auto product = [](auto a, auto b) HWY_ATTR { return hn::Mul(a, b); };
        const auto total = static_cast<T>(sum_of(n, product, y, g));
        for (int64_t i = 0; i < n; ++i) out[i] = y[i] * (g[i] - total);
        return;
      }
      const int64_t count = columns.count();
      Scratch<T> totals(static_cast<size_t>(count), T(0));
      T* total = totals.data();
      for (int64_t r = 0; r < n; ++r)
        for (int64_t i = 0; i < count; ++i) total[i] += y[r * inner + i] * g[r * inner + i];
      for (int64_t r = 0; r < n; ++r)
        for (int64_t i = 0; i < count; ++i)
          out[r * inner + i] = y[r * inner + i] * (g[r * inner + i] - total[i]);
    });
  });
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace restage::cpu {
RESTAGE_KERNEL(sum, SumArgs)
RESTAGE_KERNEL(max, MaxArgs)
RESTAGE_KERNEL(max_grad, MaxGradArgs)
RESTAGE_KERNEL(softmax, SoftmaxArgs)
RESTAGE_KERNEL(softmax_grad, SoftmaxGradArgs)
}  // namespace restage::cpu
#endif
