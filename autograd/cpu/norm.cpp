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

/// x [outer, n, inner], whose columns are normalised over n. Work is cut into blocks and, within
/// these, into parts of rows, so any number of threads has some.
struct Columns {
  int64_t outer, n, inner;
  int64_t parts = std::max<int64_t>(1, (n + kPart - 1) / kPart);

  /// f(row, block, part) for all rows of x; parts are numbered through.
  template <class F>
  void each_row(const F& f) const {
    const int64_t grain = row_grain(std::min(n, kPart) * inner);
    parallel_for(outer * parts, grain, [&](int64_t from, int64_t to) HWY_ATTR {
      for (int64_t part = from; part < to; ++part) {
        const int64_t block = part / parts, first = part % parts * kPart;
        for (int64_t r = first; r < std::min(n, first + kPart); ++r) f(block * n + r, block, part);
      }
    });
  }

  /// [outer, Count, inner]: sums over the rows of each block, in an order that sizes decide.
  /// add(row, block, sums) adds one row.
  template <int64_t Count, class F>
  Scratch<double> sums(const F& add) const {
    const int64_t width = Count * inner;
    Scratch<double> of_parts(static_cast<size_t>(outer * parts * width), 0.0),
        of_blocks(static_cast<size_t>(outer * width), 0.0);
    double *partial = of_parts.data(), *total = of_blocks.data();
    each_row([&](int64_t row, int64_t block, int64_t part)
                 HWY_ATTR { add(row, block, partial + part * width); });
    parallel_for(outer, row_grain(parts * width), [&](int64_t from, int64_t to) HWY_ATTR {
      for (int64_t part = from * parts; part < to * parts; ++part)
        for (int64_t i = 0; i < width; ++i)
          total[part / parts * width + i] += partial[part * width + i];
    });
    return of_blocks;
  }
};

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
  const Columns c{args.outer, args.n, args.inner};
  const int64_t inner = c.inner;
  const Scratch<double> scale = along_inner<T>(args.scale, args.affine, inner, 1);
  const Scratch<double> shift = along_inner<T>(args.shift, args.affine, inner, 0);
  const T* x = args.x.data<T>();
  T* out = args.out.data<T>();
  double *mean = args.mean.data<double>(), *rstd = args.rstd.data<double>();
  const Scratch<double> sums = c.sums<1>([&](int64_t row, int64_t, double* a) HWY_ATTR {
    for (int64_t i = 0; i < inner; ++i) a[i] += static_cast<double>(x[row * inner + i]);
  });
  const auto count = static_cast<double>(c.n);
  for (int64_t k = 0; k < c.outer * inner; ++k) mean[k] = sums[k] / count;
  const Scratch<double> squares = c.sums<1>([&](int64_t row, int64_t block, double* a) HWY_ATTR {
    const double* m = mean + block * inner;
    for (int64_t i = 0; i < inner; ++i) {
      const double d = static_cast<double>(x[row * inner + i]) - m[i];
      a[i] += d * d;
    }
  });
  for (int64_t k = 0; k < c.outer * inner; ++k)
    rstd[k] = 1.0 / std::sqrt(squares[k] / count + args.eps);
  const double *sc = scale.data(), *sh = shift.data();
  c.each_row([&](int64_t row, int64_t block, int64_t) HWY_ATTR {
    const double *m = mean + block * inner, *r = rstd + block * inner;
    for (int64_t i = 0; i < inner; ++i)
      out[row * inner + i] =
          static_cast<T>((static_cast<double>(x[row * inner + i]) - m[i]) * r[i] * sc[i] + sh[i]);
  });
}

template <class T>
void norm_columns_grad(const NormGradArgs& args) {
  const Columns c{args.outer, args.n, args.inner};
  const int64_t inner = c.inner;
  const Scratch<double> scale = along_inner<T>(args.scale, args.affine, inner, 1);
  const double* sc = scale.data();
  const T *x = args.x.data<T>(), *gy = args.gy.data<T>();
  T* out = args.out.data<T>();
  const double *mean = args.mean.data<double>(), *rstd = args.rstd.data<double>();
  // Per column the sum of the output's gradient, then of it times the normalised input.
  const Scratch<double> sums = c.sums<2>([&](int64_t row, int64_t block, double* a) HWY_ATTR {
    const double *m = mean + block * inner, *s = rstd + block * inner;
    double* b = a + inner;
    for (int64_t i = 0; i < inner; ++i) {
      const double g = static_cast<double>(gy[row * inner + i]);
      a[i] += g;
      b[i] += g * (static_cast<double>(x[row * inner + i]) - m[i]) * s[i];
    }
  });
  const double inv = 1.0 / static_cast<double>(c.n);
  c.each_row([&](int64_t row, int64_t block, int64_t) HWY_ATTR {
    const double *m = mean + block * inner, *s = rstd + block * inner;
    const double *sg = sums.data() + block * 2 * inner, *sgx = sg + inner;
    for (int64_t i = 0; i < inner; ++i) {
      const double h = (static_cast<double>(x[row * inner + i]) - m[i]) * s[i];
      const double g = static_cast<double>(gy[row * inner + i]);
      out[row * inner + i] = static_cast<T>(sc[i] * s[i] * (g - inv * (sg[i] + h * sgx[i])));
    }
  });
  if (args.g_scale == nullptr) return;  // only ever with one block: batch norm
  for (int64_t i = 0; i < inner; ++i) {
    args.g_shift->data<T>()[i] = static_cast<T>(sums[i]);
    args.g_scale->data<T>()[i] = static_cast<T>(sums[inner + i]);
  }
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
