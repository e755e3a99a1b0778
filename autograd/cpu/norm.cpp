#include <algorithm>
#include <cmath>
#include <vector>

#include "autograd/cpu/common.h"
#include "autograd/cpu/kernels.h"

namespace restage::cpu {
namespace {

constexpr int64_t kPart = 512;  // rows per partial sum

/// For one outer block, sums f(row, i) and g(row, i) over the rows into two double vectors, in
/// parts that depend on sizes only.
template <class F>
void two_sums(int64_t n, int64_t inner, double* a, double* b, bool parallel, F&& add_row) {
  const int64_t parts = std::max<int64_t>(1, (n + kPart - 1) / kPart);
  std::vector<double> partial(static_cast<size_t>(2 * parts * inner), 0.0);
  const auto part = [&](int64_t p) {
    double* pa = partial.data() + 2 * p * inner;
    for (int64_t r = p * kPart; r < std::min(n, (p + 1) * kPart); ++r) add_row(r, pa, pa + inner);
  };
  if (parallel) {
    parallel_for(parts, 1, [&](int64_t from, int64_t to) {
      for (int64_t p = from; p < to; ++p) part(p);
    });
  } else {
    for (int64_t p = 0; p < parts; ++p) part(p);
  }
  for (int64_t i = 0; i < inner; ++i) {
    a[i] = b[i] = 0;
    for (int64_t p = 0; p < parts; ++p) {
      a[i] += partial[static_cast<size_t>(2 * p * inner + i)];
      b[i] += partial[static_cast<size_t>((2 * p + 1) * inner + i)];
    }
  }
}

/// Runs f(o) over outer blocks: in parallel over blocks if there are several, else inside.
template <class F>
void for_blocks(int64_t outer, int64_t size, F&& f) {
  if (outer == 1) return f(0, true);
  parallel_for(outer, row_grain(size), [&](int64_t from, int64_t to) {
    for (int64_t o = from; o < to; ++o) f(o, false);
  });
}

template <class F>
void for_block_rows(int64_t n, int64_t inner, bool parallel, F&& f) {
  if (!parallel) {
    for (int64_t r = 0; r < n; ++r) f(r);
    return;
  }
  parallel_for(n, row_grain(inner), [&](int64_t from, int64_t to) {
    for (int64_t r = from; r < to; ++r) f(r);
  });
}

/// Scale of row r, column i.
template <class T>
double affine_at(const Tensor* t, Affine affine, int64_t r, int64_t i, double none) {
  if (t == nullptr || affine == Affine::none) return none;
  return static_cast<double>(t->data<T>()[affine == Affine::inner ? i : r]);
}

template <class T>
void norm_typed(const NormArgs& args) {
  const int64_t n = args.n, inner = args.inner;
  for_blocks(args.outer, n * inner, [&](int64_t o, bool parallel) {
    const T* x = args.x.data<T>() + o * n * inner;
    T* out = args.out.data<T>() + o * n * inner;
    double* mean = args.mean.data<double>() + o * inner;
    double* rstd = args.rstd.data<double>() + o * inner;
    std::vector<double> s(static_cast<size_t>(inner)), q(static_cast<size_t>(inner));
    two_sums(n, inner, s.data(), q.data(), parallel, [&](int64_t r, double* a, double*) {
      for (int64_t i = 0; i < inner; ++i) a[i] += static_cast<double>(x[r * inner + i]);
    });
    for (double& v : s) v /= static_cast<double>(n);
    std::vector<double> unused(static_cast<size_t>(inner));
    two_sums(n, inner, q.data(), unused.data(), parallel, [&](int64_t r, double* a, double*) {
      for (int64_t i = 0; i < inner; ++i) {
        const double d = static_cast<double>(x[r * inner + i]) - s[static_cast<size_t>(i)];
        a[i] += d * d;
      }
    });
    for (int64_t i = 0; i < inner; ++i) {
      mean[i] = s[static_cast<size_t>(i)];
      rstd[i] = 1.0 / std::sqrt(q[static_cast<size_t>(i)] / static_cast<double>(n) + args.eps);
    }
    for_block_rows(n, inner, parallel, [&](int64_t r) {
      for (int64_t i = 0; i < inner; ++i)
        out[r * inner + i] =
            static_cast<T>((static_cast<double>(x[r * inner + i]) - mean[i]) * rstd[i] *
                               affine_at<T>(args.scale, args.affine, r, i, 1) +
                           affine_at<T>(args.shift, args.affine, r, i, 0));
    });
  });
}

template <class T>
void norm_grad_typed(const NormGradArgs& args) {
  const int64_t n = args.n, inner = args.inner;
  for_blocks(args.outer, n * inner, [&](int64_t o, bool parallel) {
    const T* x = args.x.data<T>() + o * n * inner;
    const T* gy = args.gy.data<T>() + o * n * inner;
    const double* mean = args.mean.data<double>() + o * inner;
    const double* rstd = args.rstd.data<double>() + o * inner;
    T* out = args.out.data<T>() + o * n * inner;
    std::vector<double> sg(static_cast<size_t>(inner)), sgx(static_cast<size_t>(inner));
    two_sums(n, inner, sg.data(), sgx.data(), parallel, [&](int64_t r, double* a, double* b) {
      for (int64_t i = 0; i < inner; ++i) {
        const double g =
            static_cast<double>(gy[r * inner + i]) * affine_at<T>(args.scale, args.affine, r, i, 1);
        a[i] += g;
        b[i] += g * (static_cast<double>(x[r * inner + i]) - mean[i]) * rstd[i];
      }
    });
    const double inv = 1.0 / static_cast<double>(n);
    for_block_rows(n, inner, parallel, [&](int64_t r) {
      for (int64_t i = 0; i < inner; ++i) {
        const double g =
            static_cast<double>(gy[r * inner + i]) * affine_at<T>(args.scale, args.affine, r, i, 1);
        const double h = (static_cast<double>(x[r * inner + i]) - mean[i]) * rstd[i];
        const auto c = static_cast<size_t>(i);
        out[r * inner + i] = static_cast<T>(rstd[i] * (g - inv * (sg[c] + h * sgx[c])));
      }
    });
  });
  if (args.g_scale == nullptr) return;
  // Scale and shift: sums over everything else, outer blocks in order.
  const int64_t size = args.g_scale->numel();
  std::vector<double> a(static_cast<size_t>(size)), b(static_cast<size_t>(size));
  const bool by_row = args.affine == Affine::middle;
  const int64_t rows = by_row ? args.outer : args.outer * n;
  const int64_t width = by_row ? n * inner : inner;
  two_sums(rows, size, a.data(), b.data(), true, [&](int64_t r, double* pa, double* pb) {
    const T* x = args.x.data<T>() + r * width;
    const T* gy = args.gy.data<T>() + r * width;
    const int64_t o = by_row ? r : r / n;
    for (int64_t e = 0; e < width; ++e) {
      const int64_t i = e % inner, target = by_row ? e / inner : i;
      const double g = static_cast<double>(gy[e]);
      const double h = (static_cast<double>(x[e]) - args.mean.data<double>()[o * inner + i]) *
                       args.rstd.data<double>()[o * inner + i];
      pa[target] += g * h;
      pb[target] += g;
    }
  });
  for (int64_t i = 0; i < size; ++i) {
    args.g_scale->data<T>()[i] = static_cast<T>(a[static_cast<size_t>(i)]);
    args.g_shift->data<T>()[i] = static_cast<T>(b[static_cast<size_t>(i)]);
  }
}

}  // namespace

void norm(const NormArgs& args) {
  if (args.x.numel() == 0) return;
  dispatch(args.out.dtype(), [&](auto zero) { norm_typed<decltype(zero)>(args); });
}

void norm_grad(const NormGradArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) { norm_grad_typed<decltype(zero)>(args); });
}

}  // namespace restage::cpu
