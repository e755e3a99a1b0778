#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "autograd/cpu/norm.cpp"
#include <hwy/foreach_target.h>  // once per instruction set

#include <algorithm>
#include <cmath>

#include "autograd/cpu/common.h"
#include "autograd/cpu/kernels.h"
#include "autograd/cpu/math-inl.h"
#include "autograd/cpu/targets.h"
#include "autograd/kernels/scratch.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {
namespace {

constexpr int64_t kPart = 512;  // rows per partial sum

/// For one outer block, sums f(row, i) and g(row, i) over the rows into two double vectors, in
/// parts that depend on sizes only.
template <class F>
void two_sums(int64_t n, int64_t inner, double* a, double* b, bool parallel, F&& add_row) {
  const int64_t parts = std::max<int64_t>(1, (n + kPart - 1) / kPart);
  Scratch<double> partial(static_cast<size_t>(2 * parts * inner), 0.0);
  const auto part = [&](int64_t p) HWY_ATTR {
    double* pa = partial.data() + 2 * p * inner;
    for (int64_t r = p * kPart; r < std::min(n, (p + 1) * kPart); ++r) add_row(r, pa, pa + inner);
  };
  if (parallel) {
    parallel_for(parts, 1, [&](int64_t from, int64_t to) HWY_ATTR {
      for (int64_t p = from; p < to; ++p) part(p);
    });
  } else {
    for (int64_t p = 0; p < parts; ++p) part(p);
  }
  for (int64_t i = 0; i < inner; ++i) {
    a[i] = b[i] = 0;
    for (int64_t p = 0; p < parts; ++p) {
      a[i] += partial[2 * p * inner + i];
      b[i] += partial[(2 * p + 1) * inner + i];
    }
  }
}

/// Runs f(o) over outer blocks: in parallel over blocks if there are several, else inside.
template <class F>
void for_blocks(int64_t outer, int64_t size, F&& f) {
  if (outer == 1) return f(0, true);
  parallel_for(outer, row_grain(size), [&](int64_t from, int64_t to) HWY_ATTR {
    for (int64_t o = from; o < to; ++o) f(o, false);
  });
}

template <class F>
void for_block_rows(int64_t n, int64_t inner, bool parallel, F&& f) {
  if (!parallel) {
    for (int64_t r = 0; r < n; ++r) f(r);
    return;
  }
  parallel_for(n, row_grain(inner), [&](int64_t from, int64_t to) HWY_ATTR {
    for (int64_t r = from; r < to; ++r) f(r);
  });
}

/// A parameter along the inner axis as doubles, or `none` where there is no such parameter.
template <class T>
Scratch<double> along_inner(const Tensor* t, Affine affine, int64_t inner, double none) {
  Scratch<double> out(static_cast<size_t>(inner), none);
  if (t == nullptr || affine != Affine::inner) return out;
  for (int64_t i = 0; i < inner; ++i) out[i] = static_cast<double>(t->data<T>()[i]);
  return out;
}

template <class T>
void norm_columns(const NormArgs& args) {
  const int64_t n = args.n, inner = args.inner;
  const Scratch<double> scale = along_inner<T>(args.scale, args.affine, inner, 1);
  const Scratch<double> shift = along_inner<T>(args.shift, args.affine, inner, 0);
  for_blocks(args.outer, n * inner, [&](int64_t o, bool parallel) HWY_ATTR {
    const T* x = args.x.data<T>() + o * n * inner;
    T* out = args.out.data<T>() + o * n * inner;
    double* mean = args.mean.data<double>() + o * inner;
    double* rstd = args.rstd.data<double>() + o * inner;
    Scratch<double> sums(static_cast<size_t>(inner)), unused(sums);
    two_sums(n, inner, sums.data(), unused.data(), parallel,
             [&](int64_t r, double* a, double*) HWY_ATTR {
               for (int64_t i = 0; i < inner; ++i) a[i] += static_cast<double>(x[r * inner + i]);
             });
    for (int64_t i = 0; i < inner; ++i) mean[i] = sums[i] / static_cast<double>(n);
    two_sums(n, inner, sums.data(), unused.data(), parallel,
             [&](int64_t r, double* a, double*) HWY_ATTR {
               for (int64_t i = 0; i < inner; ++i) {
                 const double d = static_cast<double>(x[r * inner + i]) - mean[i];
                 a[i] += d * d;
               }
             });
    for (int64_t i = 0; i < inner; ++i)
      rstd[i] = 1.0 / std::sqrt(sums[i] / static_cast<double>(n) + args.eps);
    const double *sc = scale.data(), *sh = shift.data();
    for_block_rows(n, inner, parallel, [&](int64_t r) HWY_ATTR {
      for (int64_t i = 0; i < inner; ++i)
        out[r * inner + i] = static_cast<T>(
            (static_cast<double>(x[r * inner + i]) - mean[i]) * rstd[i] * sc[i] + sh[i]);
    });
  });
}

template <class T>
void norm_columns_grad(const NormGradArgs& args) {
  const int64_t n = args.n, inner = args.inner;
  const Scratch<double> scale = along_inner<T>(args.scale, args.affine, inner, 1);
  const double* sc = scale.data();
  for_blocks(args.outer, n * inner, [&](int64_t o, bool parallel) HWY_ATTR {
    const T* x = args.x.data<T>() + o * n * inner;
    const T* gy = args.gy.data<T>() + o * n * inner;
    const double* mean = args.mean.data<double>() + o * inner;
    const double* rstd = args.rstd.data<double>() + o * inner;
    T* out = args.out.data<T>() + o * n * inner;
    // Sums of the output's gradient, and of it times the normalised input, per column.
    Scratch<double> sg(static_cast<size_t>(inner)), sgx(sg);
    two_sums(n, inner, sg.data(), sgx.data(), parallel,
             [&](int64_t r, double* a, double* b) HWY_ATTR {
               for (int64_t i = 0; i < inner; ++i) {
                 const double g = static_cast<double>(gy[r * inner + i]);
                 a[i] += g;
                 b[i] += g * (static_cast<double>(x[r * inner + i]) - mean[i]) * rstd[i];
               }
             });
    const double inv = 1.0 / static_cast<double>(n);
    const double *pg = sg.data(), *pgx = sgx.data();
    for_block_rows(n, inner, parallel, [&](int64_t r) HWY_ATTR {
      for (int64_t i = 0; i < inner; ++i) {
        const double h = (static_cast<double>(x[r * inner + i]) - mean[i]) * rstd[i];
        const double g = static_cast<double>(gy[r * inner + i]);
        out[r * inner + i] = static_cast<T>(sc[i] * rstd[i] * (g - inv * (pg[i] + h * pgx[i])));
      }
    });
    if (args.g_scale == nullptr) return;  // only ever with one block: batch norm
    for (int64_t i = 0; i < inner; ++i) {
      args.g_scale->data<T>()[i] = static_cast<T>(pgx[i]);
      args.g_shift->data<T>()[i] = static_cast<T>(pg[i]);
    }
  });
}

/// Layer norm: every row by itself, scale and shift along the row. Rows are short, so their sums
/// are in T.
template <class T>
void norm_rows(const NormArgs& args) {
  const int64_t n = args.n;
  const T *scale = args.scale->data<T>(), *shift = args.shift->data<T>();
  parallel_for(args.outer, row_grain(n), [&](int64_t from, int64_t to) HWY_ATTR {
    const hn::ScalableTag<T> d;
    using V = hn::Vec<decltype(d)>;
    for (int64_t o = from; o < to; ++o) {
      const T* x = args.x.data<T>() + o * n;
      T* out = args.out.data<T>() + o * n;
      const double count = static_cast<double>(n);
      const double mean = sum_of(
                              n, [](auto v) HWY_ATTR { return v; }, x) /
                          count;
      const auto centred = static_cast<T>(mean);
      const auto square = [&](auto v) HWY_ATTR {
        const auto c = hn::Sub(v, hn::Set(hn::DFromV<decltype(v)>(), centred));
        return hn::Mul(c, c);
      };
      const double rstd = 1.0 / std::sqrt(sum_of(n, square, x) / count + args.eps);
      args.mean.data<double>()[o] = mean;
      args.rstd.data<double>()[o] = rstd;
      const V m = hn::Set(d, centred), r = hn::Set(d, static_cast<T>(rstd));
      const auto apply = [&](V v, V sc, V sh)
                             HWY_ATTR { return hn::MulAdd(hn::Mul(hn::Sub(v, m), r), sc, sh); };
      map(n, out, apply, x, scale, shift);
    }
  });
}

template <class T>
void norm_rows_grad(const NormGradArgs& args) {
  const int64_t n = args.n;
  const T* scale = args.scale->data<T>();
  const int64_t parts = std::max<int64_t>(1, (args.outer + kPart - 1) / kPart);
  // Per part of rows: the gradient of the scale, then that of the shift.
  Scratch<double> partial(static_cast<size_t>(2 * parts * n), 0.0);
  parallel_for(parts, 1, [&](int64_t from, int64_t to) HWY_ATTR {
    const hn::ScalableTag<T> d;
    using V = hn::Vec<decltype(d)>;
    Scratch<T> normalised(static_cast<size_t>(n)), scaled(static_cast<size_t>(n));
    T *h = normalised.data(), *gs = scaled.data();
    for (int64_t o = from * kPart; o < std::min(args.outer, to * kPart); ++o) {
      const T *x = args.x.data<T>() + o * n, *g = args.gy.data<T>() + o * n;
      const V mean = hn::Set(d, static_cast<T>(args.mean.data<double>()[o]));
      const V rstd = hn::Set(d, static_cast<T>(args.rstd.data<double>()[o]));
      map(
          n, h, [&](V v) HWY_ATTR { return hn::Mul(hn::Sub(v, mean), rstd); }, x);
      map(
          n, gs, [](V a, V b) HWY_ATTR { return hn::Mul(a, b); }, g, scale);
      double* g_scale = partial.data() + o / kPart * 2 * n;
      double* g_shift = g_scale + n;
      for (int64_t i = 0; i < n; ++i) {
        g_scale[i] += static_cast<double>(g[i] * h[i]);
        g_shift[i] += static_cast<double>(g[i]);
      }
      const double count = static_cast<double>(n);
      const double sg = sum_of(
                            n, [](auto v) HWY_ATTR { return v; }, gs) /
                        count;
      const double sgx = sum_of(
                             n, [](auto a, auto b) HWY_ATTR { return hn::Mul(a, b); }, gs, h) /
                         count;
      const V vg = hn::Set(d, static_cast<T>(sg)), vgx = hn::Set(d, static_cast<T>(sgx));
      const auto apply = [&](V a, V b) HWY_ATTR {
        return hn::Mul(rstd, hn::NegMulAdd(b, vgx, hn::Sub(a, vg)));
      };
      map(n, args.out.data<T>() + o * n, apply, gs, h);
    }
  });
  if (args.g_scale == nullptr) return;
  for (int64_t i = 0; i < n; ++i) {
    double g_scale = 0, g_shift = 0;
    for (int64_t p = 0; p < parts; ++p) {
      g_scale += partial[2 * p * n + i];
      g_shift += partial[(2 * p + 1) * n + i];
    }
    args.g_scale->data<T>()[i] = static_cast<T>(g_scale);
    args.g_shift->data<T>()[i] = static_cast<T>(g_shift);
  }
}

}  // namespace

void norm(const NormArgs& args) {
  if (args.x.numel() == 0) return;
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR {
    using T = decltype(zero);
    args.affine == Affine::middle ? norm_rows<T>(args) : norm_columns<T>(args);
  });
}

void norm_grad(const NormGradArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR {
    using T = decltype(zero);
    args.affine == Affine::middle ? norm_rows_grad<T>(args) : norm_columns_grad<T>(args);
  });
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace restage::cpu {
RESTAGE_KERNEL(norm, NormArgs)
RESTAGE_KERNEL(norm_grad, NormGradArgs)
}  // namespace restage::cpu
#endif
