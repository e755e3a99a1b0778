#include <algorithm>
#include <cmath>

#include "autograd/cpu/common.h"
#include "autograd/cpu/kernels.h"
#include "autograd/kernels/scratch.h"

namespace restage::cpu {
namespace {

constexpr int64_t kPart = 512;  // rows per partial sum

/// For one outer block, sums f(row, i) and g(row, i) over the rows into two double vectors, in
/// parts that depend on sizes only.
template <class F>
void two_sums(int64_t n, int64_t inner, double* a, double* b, bool parallel, F&& add_row) {
  const int64_t parts = std::max<int64_t>(1, (n + kPart - 1) / kPart);
  Scratch<double> partial(static_cast<size_t>(2 * parts * inner), 0.0);
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

/// A parameter along the inner axis as doubles, or `none` where there is no such parameter.
template <class T>
Scratch<double> along_inner(const Tensor* t, Affine affine, int64_t inner, double none) {
  Scratch<double> out(static_cast<size_t>(inner), none);
  if (t == nullptr || affine != Affine::inner) return out;
  for (int64_t i = 0; i < inner; ++i)
    out[static_cast<size_t>(i)] = static_cast<double>(t->data<T>()[i]);
  return out;
}

template <class T>
void norm_columns(const NormArgs& args) {
  const int64_t n = args.n, inner = args.inner;
  const Scratch<double> scale = along_inner<T>(args.scale, args.affine, inner, 1);
  const Scratch<double> shift = along_inner<T>(args.shift, args.affine, inner, 0);
  for_blocks(args.outer, n * inner, [&](int64_t o, bool parallel) {
    const T* x = args.x.data<T>() + o * n * inner;
    T* out = args.out.data<T>() + o * n * inner;
    double* mean = args.mean.data<double>() + o * inner;
    double* rstd = args.rstd.data<double>() + o * inner;
    Scratch<double> sums(static_cast<size_t>(inner)), unused(sums);
    two_sums(n, inner, sums.data(), unused.data(), parallel, [&](int64_t r, double* a, double*) {
      for (int64_t i = 0; i < inner; ++i) a[i] += static_cast<double>(x[r * inner + i]);
    });
    for (int64_t i = 0; i < inner; ++i)
      mean[i] = sums[static_cast<size_t>(i)] / static_cast<double>(n);
    two_sums(n, inner, sums.data(), unused.data(), parallel, [&](int64_t r, double* a, double*) {
      for (int64_t i = 0; i < inner; ++i) {
        const double d = static_cast<double>(x[r * inner + i]) - mean[i];
        a[i] += d * d;
      }
    });
    for (int64_t i = 0; i < inner; ++i)
      rstd[i] = 1.0 / std::sqrt(sums[static_cast<size_t>(i)] / static_cast<double>(n) + args.eps);
    const double *sc = scale.data(), *sh = shift.data();
    for_block_rows(n, inner, parallel, [&](int64_t r) {
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
  for_blocks(args.outer, n * inner, [&](int64_t o, bool parallel) {
    const T* x = args.x.data<T>() + o * n * inner;
    const T* gy = args.gy.data<T>() + o * n * inner;
    const double* mean = args.mean.data<double>() + o * inner;
    const double* rstd = args.rstd.data<double>() + o * inner;
    T* out = args.out.data<T>() + o * n * inner;
    // Sums of the output's gradient, and of it times the normalised input, per column.
    Scratch<double> sg(static_cast<size_t>(inner)), sgx(sg);
    two_sums(n, inner, sg.data(), sgx.data(), parallel, [&](int64_t r, double* a, double* b) {
      for (int64_t i = 0; i < inner; ++i) {
        const double g = static_cast<double>(gy[r * inner + i]);
        a[i] += g;
        b[i] += g * (static_cast<double>(x[r * inner + i]) - mean[i]) * rstd[i];
      }
    });
    const double inv = 1.0 / static_cast<double>(n);
    const double *pg = sg.data(), *pgx = sgx.data();
    for_block_rows(n, inner, parallel, [&](int64_t r) {
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

/// Layer norm: every row by itself, scale and shift along the row.
template <class T>
void norm_rows(const NormArgs& args) {
  const int64_t n = args.n;
  const auto scale = ConstArray<T>(args.scale->data<T>(), n).template cast<double>();
  const auto shift = ConstArray<T>(args.shift->data<T>(), n).template cast<double>();
  parallel_for(args.outer, row_grain(n), [&](int64_t from, int64_t to) {
    Scratch<double> row(static_cast<size_t>(n));
    MutableArray<double> d(row.data(), n);
    for (int64_t o = from; o < to; ++o) {
      d = ConstArray<T>(args.x.data<T>() + o * n, n).template cast<double>();
      const double mean = d.sum() / static_cast<double>(n);
      d -= mean;
      const double rstd = 1.0 / std::sqrt(d.square().sum() / static_cast<double>(n) + args.eps);
      args.mean.data<double>()[o] = mean;
      args.rstd.data<double>()[o] = rstd;
      MutableArray<T>(args.out.data<T>() + o * n, n) =
          (d * rstd * scale + shift).template cast<T>();
    }
  });
}

template <class T>
void norm_rows_grad(const NormGradArgs& args) {
  const int64_t n = args.n;
  const Eigen::ArrayXd scale = ConstArray<T>(args.scale->data<T>(), n).template cast<double>();
  const int64_t parts = std::max<int64_t>(1, (args.outer + kPart - 1) / kPart);
  Eigen::ArrayXXd g_scale = Eigen::ArrayXXd::Zero(n, parts), g_shift = g_scale;  // per part of rows
  parallel_for(parts, 1, [&](int64_t from, int64_t to) {
    Eigen::ArrayXd g(n), h(n);
    for (int64_t o = from * kPart; o < std::min(args.outer, to * kPart); ++o) {
      const double rstd = args.rstd.data<double>()[o];
      g = ConstArray<T>(args.gy.data<T>() + o * n, n).template cast<double>();
      h = (ConstArray<T>(args.x.data<T>() + o * n, n).template cast<double>() -
           args.mean.data<double>()[o]) *
          rstd;
      g_scale.col(o / kPart) += g * h;
      g_shift.col(o / kPart) += g;
      g *= scale;
      const double sg = g.sum() / static_cast<double>(n),
                   sgx = (g * h).sum() / static_cast<double>(n);
      MutableArray<T>(args.out.data<T>() + o * n, n) =
          (rstd * (g - sg - h * sgx)).template cast<T>();
    }
  });
  if (args.g_scale == nullptr) return;
  for (int64_t p = 1; p < parts; ++p) {
    g_scale.col(0) += g_scale.col(p);
    g_shift.col(0) += g_shift.col(p);
  }
  MutableArray<T>(args.g_scale->data<T>(), n) = g_scale.col(0).template cast<T>();
  MutableArray<T>(args.g_shift->data<T>(), n) = g_shift.col(0).template cast<T>();
}

}  // namespace

void norm(const NormArgs& args) {
  if (args.x.numel() == 0) return;
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    args.affine == Affine::middle ? norm_rows<T>(args) : norm_columns<T>(args);
  });
}

void norm_grad(const NormGradArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    args.affine == Affine::middle ? norm_rows_grad<T>(args) : norm_columns_grad<T>(args);
  });
}

}  // namespace restage::cpu
