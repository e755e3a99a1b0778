#include <algorithm>
#include <cmath>

#include "autograd/cpu/common.h"
#include "autograd/cpu/kernels.h"
#include "autograd/kernels/scratch.h"

namespace restage::cpu {
namespace {

constexpr int64_t kPart = 512;  // terms per partial sum

/// Sums rows [from, to) of x [n, inner] into out [inner] (overwritten), in double, since what is
/// summed (gradients of a bias) may all but cancel.
template <class T>
void sum_rows(const T* x, int64_t from, int64_t to, int64_t inner, T* out) {
  constexpr int64_t kColumns = 128;  // at a time
  double total[kColumns];
  for (int64_t i0 = 0; i0 < inner; i0 += kColumns) {
    const int64_t columns = std::min(kColumns, inner - i0);
    std::fill_n(total, columns, 0.0);
    for (int64_t r = from; r < to; ++r) {
      const T* row = x + r * inner + i0;
      for (int64_t i = 0; i < columns; ++i) total[i] += static_cast<double>(row[i]);
    }
    for (int64_t i = 0; i < columns; ++i) out[i0 + i] = static_cast<T>(total[i]);
  }
}

template <class T>
void sum_typed(const SumArgs& args) {
  const T* x = args.x.data<T>();
  T* out = args.out.data<T>();
  const int64_t n = args.n, inner = args.inner;
  const int64_t parts = std::max<int64_t>(1, (n + kPart - 1) / kPart);
  if (parts == 1) {
    parallel_for(args.outer, row_grain(n * inner), [&](int64_t from, int64_t to) {
      for (int64_t o = from; o < to; ++o) sum_rows(x + o * n * inner, 0, n, inner, out + o * inner);
    });
    return;
  }
  Tensor scratch = Tensor::empty({args.outer, parts, inner}, args.out.dtype());
  T* partial = scratch.data<T>();
  parallel_for(args.outer * parts, row_grain(kPart * inner), [&](int64_t from, int64_t to) {
    for (int64_t t = from; t < to; ++t) {
      const int64_t o = t / parts, p = t % parts;
      sum_rows(x + o * n * inner, p * kPart, std::min(n, (p + 1) * kPart), inner,
               partial + t * inner);
    }
  });
  for (int64_t o = 0; o < args.outer; ++o)
    sum_rows(partial + o * parts * inner, 0, parts, inner, out + o * inner);
}

/// Calls f(o) for every outer row, several per piece.
template <class F>
void for_rows(int64_t outer, int64_t row_size, F&& f) {
  parallel_for(outer, row_grain(row_size), [&](int64_t from, int64_t to) {
    for (int64_t o = from; o < to; ++o) f(o);
  });
}

}  // namespace

void sum(const SumArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) { sum_typed<decltype(zero)>(args); });
}

void max(const MaxArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    const int64_t n = args.n, inner = args.inner;
    for_rows(args.outer, n * inner, [&](int64_t o) {
      const T* x = args.x.data<T>() + o * n * inner;
      T* best = args.out.data<T>() + o * inner;
      int32_t* at = args.index.data<int32_t>() + o * inner;
      std::copy_n(x, inner, best);
      std::fill_n(at, inner, 0);
      for (int64_t r = 1; r < n; ++r) {
        const T* row = x + r * inner;
        for (int64_t i = 0; i < inner; ++i) {
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
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    const int64_t n = args.n, inner = args.inner;
    for_rows(args.outer, n * inner, [&](int64_t o) {
      T* out = args.out.data<T>() + o * n * inner;
      const T* gy = args.gy.data<T>() + o * inner;
      const int32_t* at = args.index.data<int32_t>() + o * inner;
      std::fill_n(out, n * inner, T(0));
      for (int64_t i = 0; i < inner; ++i) out[at[i] * inner + i] = gy[i];
    });
  });
}

void softmax(const SoftmaxArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    const int64_t n = args.n, inner = args.inner;
    for_rows(args.outer, n * inner, [&](int64_t o) {
      const T* x = args.x.data<T>() + o * n * inner;
      T* y = args.out.data<T>() + o * n * inner;
      if (inner == 1) {
        const ConstArray<T> in(x, n);
        MutableArray<T> out(y, n);
        out = (in - in.maxCoeff()).exp();
        out /= out.sum();
        return;
      }
      Scratch<T> top(x, x + inner), total(static_cast<size_t>(inner), T(0));
      MutableArray<T> t(top.data(), inner), s(total.data(), inner);
      for (int64_t r = 1; r < n; ++r) t = t.max(ConstArray<T>(x + r * inner, inner));
      for (int64_t r = 0; r < n; ++r) {
        MutableArray<T> out(y + r * inner, inner);
        out = (ConstArray<T>(x + r * inner, inner) - t).exp();
        s += out;
      }
      for (int64_t r = 0; r < n; ++r) MutableArray<T>(y + r * inner, inner) /= s;
    });
  });
}

void softmax_grad(const SoftmaxGradArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    const int64_t n = args.n, inner = args.inner;
    for_rows(args.outer, n * inner, [&](int64_t o) {
      const T* y = args.y.data<T>() + o * n * inner;
      const T* g = args.gy.data<T>() + o * n * inner;
      T* out = args.out.data<T>() + o * n * inner;
      if (inner == 1) {
        const ConstArray<T> ya(y, n), ga(g, n);
        MutableArray<T>(out, n) = ya * (ga - (ya * ga).sum());
        return;
      }
      Scratch<T> total(static_cast<size_t>(inner), T(0));
      MutableArray<T> s(total.data(), inner);
      for (int64_t r = 0; r < n; ++r)
        s += ConstArray<T>(y + r * inner, inner) * ConstArray<T>(g + r * inner, inner);
      for (int64_t r = 0; r < n; ++r)
        MutableArray<T>(out + r * inner, inner) =
            ConstArray<T>(y + r * inner, inner) * (ConstArray<T>(g + r * inner, inner) - s);
    });
  });
}

}  // namespace restage::cpu
