// Linear map, batch norm and maximum over points, in one (kernels/pooled_norm.h).
//
// With h the input less its mean, z = W h is the map's result less its mean, so variance and maxima
// come from register tiles of z as they are made, and no tile is kept.
//
// Backward: with a = scale * rstd, the gradient into z of point r and channel c is
//   a_c (g_c [r is the maximum of c] - sum(g_c) / N - xhat_rc sum(g_c xhat_c) / N).
// The first term has one point per cloud and channel. The second is the same for all points. The
// third is k_c w_c . h_r, so over all channels it gives M h_r with M = W^T diag(k) W, and to the
// weights diag(k) W G with the Gram matrix G of h (centred, or its sums would all but cancel).
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "autograd/cpu/pooled_norm.cpp"
#include <hwy/foreach_target.h>  // once per instruction set

#include <cmath>
#include <limits>

#include "autograd/cpu/common.h"
#include "autograd/cpu/gemm_tile-inl.h"
#include "autograd/cpu/kernels.h"
#include "autograd/cpu/targets.h"
#include "autograd/kernels/scratch.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

constexpr int64_t kSquares = 12;  // rows per partial sum of squares: a multiple of every kRows
static_assert(kSquares % kRows == 0);

/// out = x less its mean over the rows [rows, k]; the mean [1, k].
template <class T>
void centre(const Tensor& x, int64_t rows, int64_t k, Tensor& mean, Tensor& out) {
  cpu::sum(SumArgs{x, mean, 1, rows, k});
  T* m = mean.data<T>();
  for (int64_t i = 0; i < k; ++i) m[i] /= static_cast<T>(rows);
  parallel_for(rows, row_grain(k), [&](int64_t from, int64_t to) HWY_ATTR {
    for (int64_t r = from; r < to; ++r) {
      const T* in = x.data<T>() + r * k;
      T* h = out.data<T>() + r * k;
      for (int64_t i = 0; i < k; ++i) h[i] = in[i] - m[i];
    }
  });
}

/// Maxima over the points of one cloud, of one panel of channels. `sign`: of the scale, by which
/// the largest or smallest z is looked for; if it is 0 all values are equal, and the first point is
/// taken.
template <class T>
struct Peaks {
  static constexpr int cols = Simd<T>::cols;
  using Index = hwy::MakeSigned<T>;
  T sign[cols], best[cols], squares[cols];
  Index at[cols];
  double sum[cols];  // of squares, kSquares rows at a time in T

  Peaks(const T* scale, int64_t channels) {
    for (int j = 0; j < cols; ++j) {
      const T s = j < channels ? scale[j] : T(0);
      sign[j] = T(s > 0) - T(s < 0);
      best[j] = -std::numeric_limits<T>::infinity();
      squares[j] = 0;
      at[j] = 0;
      sum[j] = 0;
    }
  }

  /// Takes a register tile: `rows` points from `point` on.
  void add(const T* tile, int64_t point, int64_t rows) {
    const hn::ScalableTag<T> d;
    const hn::RebindToSigned<decltype(d)> di;
    for (int j = 0; j < cols; j += static_cast<int>(hn::Lanes(d))) {
      const auto s = hn::LoadU(d, sign + j);
      auto top = hn::LoadU(d, best + j), square = hn::LoadU(d, squares + j);
      auto where = hn::LoadU(di, at + j);
      for (int64_t i = 0; i < rows; ++i) {
        const auto z = hn::LoadU(d, tile + i * cols + j), value = hn::Mul(z, s);
        const auto better = hn::Gt(value, top);
        top = hn::IfThenElse(better, value, top);
        where = hn::IfThenElse(hn::RebindMask(di, better),
                               hn::Set(di, static_cast<Index>(point + i)), where);
        square = hn::MulAdd(z, z, square);
      }
      hn::StoreU(top, d, best + j);
      hn::StoreU(where, di, at + j);
      hn::StoreU(square, d, squares + j);
    }
    if ((point + kRows) % kSquares == 0) fold();
  }

  void fold() {
    for (int j = 0; j < cols; ++j) {
      sum[j] += static_cast<double>(squares[j]);
      squares[j] = 0;
    }
  }
};

template <class T>
T dot(const T* a, const T* b, int64_t k) {
  T total = 0;
  for (int64_t l = 0; l < k; ++l) total += a[l] * b[l];
  return total;
}

/// z = h W^T per cloud, not kept: index and value (in `peak`) of its maxima, and the sums of its
/// squares [n, o] per cloud.
template <class T>
void find_peaks(const PooledNormArgs& args, double* squares) {
  constexpr int cols = Simd<T>::cols;
  const int64_t n = args.x.size(0), v = args.x.size(1), k = args.x.size(2), o = args.out.size(1);
  const int64_t row_panels = (v + kRows - 1) / kRows, col_panels = (o + cols - 1) / cols;
  const int64_t a_size = row_panels * kRows * k, b_size = cols * k;
  Tensor a = empty_like(args.out, {n * a_size});
  Tensor b = empty_like(args.out, {col_panels * b_size});
  const T *h = args.centred.data<T>(), *w = args.weight.data<T>();
  T *pa = a.data<T>(), *pb = b.data<T>();
  parallel_for(n + col_panels, 1, [&](int64_t from, int64_t to) HWY_ATTR {
    for (int64_t t = from; t < to; ++t) {
      const int64_t j0 = (t - n) * cols;
      if (t < n) {
        pack_a<T>({h + t * v * k, k, 1}, v, k, pa + t * a_size);
      } else {
        pack_b<T>({w + j0 * k, 1, k}, k, std::min<int64_t>(cols, o - j0), pb + (t - n) * b_size);
      }
    }
  });
  const int64_t grain = std::max<int64_t>(1, (1 << 18) / std::max<int64_t>(1, 2 * v * b_size));
  parallel_for(n * col_panels, grain, [&](int64_t from, int64_t to) HWY_ATTR {
    T tile[kRows * cols];
    for (int64_t t = from; t < to; ++t) {
      const int64_t s = t / col_panels, j0 = t % col_panels * cols;
      const int64_t channels = std::min<int64_t>(cols, o - j0);
      Peaks<T> peaks(args.scale.data<T>() + j0, channels);
      for (int64_t p = 0; p < row_panels; ++p) {
        multiply<T>(k, pa + s * a_size + p * kRows * k, pb + j0 * k, tile);
        peaks.add(tile, p * kRows, std::min<int64_t>(kRows, v - p * kRows));
      }
      peaks.fold();
      for (int64_t j = 0; j < channels; ++j) {
        const int64_t c = s * o + j0 + j;
        args.index.data<int32_t>()[c] = static_cast<int32_t>(peaks.at[j]);
        args.peak.data<T>()[c] = peaks.sign[j] != 0 ? peaks.sign[j] * peaks.best[j]
                                                    : dot(h + s * v * k, w + (j0 + j) * k, k);
        squares[c] = peaks.sum[j];
      }
    }
  });
}

/// Statistics of the channels, and the result from the maxima.
template <class T>
void finish(const PooledNormArgs& args, const double* squares, const T* mean) {
  const int64_t n = args.x.size(0), o = args.out.size(1), rows = n * args.x.size(1);
  const bool relu = args.activation == Activation::relu;
  const T *scale = args.scale.data<T>(), *shift = args.shift.data<T>(), *bias = args.bias.data<T>();
  T *peak = args.peak.data<T>(), *out = args.out.data<T>();
  for (int64_t c = 0; c < o; ++c) {
    double total = 0;
    for (int64_t s = 0; s < n; ++s) total += squares[s * o + c];
    // What is not finite must stay visible, also from points that are no maximum.
    const double variance = std::isfinite(total) ? total / static_cast<double>(rows)
                                                 : std::numeric_limits<double>::quiet_NaN();
    const double rstd = 1.0 / std::sqrt(variance + args.eps);
    args.mean.data<double>()[c] = static_cast<double>(mean[c]);
    args.variance.data<double>()[c] = variance;
    args.rstd.data<double>()[c] = rstd;
    const T zero = bias[c] - bias[c];  // NaN from a bias that is not finite
    for (int64_t s = 0; s < n; ++s) {
      const double xhat = static_cast<double>(peak[s * o + c]) * rstd;
      const T y = static_cast<T>(xhat * static_cast<double>(scale[c]) +
                                 static_cast<double>(shift[c] + zero));
      peak[s * o + c] = static_cast<T>(xhat);
      out[s * o + c] = relu && y <= T(0) ? T(0) : y;  // NaN stays
    }
  }
}

// Products here are in float32 whatever the precision of other ops is: they belong to sums that
// fused loops make in float32, and summands that must cancel would not.

template <class T>
void forward(const PooledNormArgs& args) {
  const int64_t n = args.x.size(0), v = args.x.size(1), k = args.x.size(2), o = args.out.size(1);
  Tensor x_mean = empty_like(args.out, {1, k});
  Tensor z_mean = empty_like(args.out, {1, o});
  centre<T>(args.x, n * v, k, x_mean, args.centred);
  cpu::matmul({x_mean, args.weight, z_mean, false, true, &args.bias});
  Scratch<double> squares(static_cast<size_t>(n * o));
  find_peaks<T>(args, squares.data());
  finish<T>(args, squares.data(), z_mean.data<T>());
}

/// What the gradients are made of, per channel; `peak` per cloud and channel.
struct Factors {
  Tensor peak;      ///< [n, o] gradient into z at the maximum
  Tensor constant;  ///< [1, o] gradient into z at all points
  Tensor slope;     ///< [o] gradient into z at all points, per unit of z
};

template <class T>
Factors factors(const PooledNormGradArgs& args) {
  const int64_t n = args.gy.size(0), o = args.gy.size(1);
  const double rows = static_cast<double>(n * args.centred.size(1));
  const bool relu = args.activation == Activation::relu;
  Factors f{empty_like(args.gy), empty_like(args.gy, {1, o}), empty_like(args.gy, {o})};
  const T *gy = args.gy.data<T>(), *y = args.y.data<T>(), *xhat = args.peak.data<T>();
  T* peak = f.peak.data<T>();
  for (int64_t c = 0; c < o; ++c) {
    const double rstd = args.rstd.data<double>()[c];
    const double a = static_cast<double>(args.scale.data<T>()[c]) * rstd;
    double g_shift = 0, g_scale = 0;
    for (int64_t s = 0; s < n; ++s) {
      const int64_t at = s * o + c;
      const double g = relu && y[at] <= T(0) ? 0.0 : static_cast<double>(gy[at]);
      g_shift += g;
      g_scale += g * static_cast<double>(xhat[at]);
      peak[at] = static_cast<T>(a * g);
    }
    args.g_shift.data<T>()[c] = static_cast<T>(g_shift);
    args.g_scale.data<T>()[c] = static_cast<T>(g_scale);
    f.constant.data<T>()[c] = static_cast<T>(-a * g_shift / rows);
    f.slope.data<T>()[c] = static_cast<T>(-a * rstd * g_scale / rows);
  }
  return f;
}

/// out[c] = slope[c] * x[c], by rows of k.
template <class T>
void scale_rows(const T* slope, const T* x, int64_t rows, int64_t k, T* out) {
  for (int64_t c = 0; c < rows; ++c)
    for (int64_t i = 0; i < k; ++i) out[c * k + i] = slope[c] * x[c * k + i];
}

/// g_weight = diag(slope) W G + what the maxima add.
template <class T>
void weight_gradient(const PooledNormGradArgs& args, const Factors& f) {
  const int64_t n = args.gy.size(0), o = args.gy.size(1), v = args.centred.size(1),
                k = args.centred.size(2);
  const Tensor h = args.centred.reshape({n * v, k});
  Tensor gram = empty_like(h, {k, k});
  cpu::matmul({h, h, gram, true, false});
  cpu::matmul({args.weight, gram, args.g_weight});
  const int32_t* index = args.index.data<int32_t>();
  parallel_for(o, row_grain(k * (n + 1)), [&](int64_t from, int64_t to) HWY_ATTR {
    for (int64_t c = from; c < to; ++c) {
      T* g = args.g_weight.data<T>() + c * k;
      scale_rows(f.slope.data<T>() + c, g, 1, k, g);
      for (int64_t s = 0; s < n; ++s) {
        const T at_peak = f.peak.data<T>()[s * o + c];
        const T* row = h.data<T>() + (s * v + index[s * o + c]) * k;
        for (int64_t i = 0; i < k; ++i) g[i] += at_peak * row[i];
      }
    }
  });
}

/// out = h M + constant W + what the maxima add, M = W^T diag(slope) W.
template <class T>
void input_gradient(const PooledNormGradArgs& args, const Factors& f) {
  const int64_t n = args.gy.size(0), o = args.gy.size(1), v = args.centred.size(1),
                k = args.centred.size(2);
  const T* w = args.weight.data<T>();
  Tensor scaled = empty_like(args.gy, {o, k});
  Tensor m = empty_like(args.gy, {k, k});
  Tensor everywhere = empty_like(args.gy, {1, k});
  scale_rows(f.slope.data<T>(), w, o, k, scaled.data<T>());
  cpu::matmul({args.weight, scaled, m, true, false});
  cpu::matmul({f.constant, args.weight, everywhere});
  Tensor out = args.out.reshape({n * v, k});
  cpu::matmul({args.centred.reshape({n * v, k}), m, out, false, false, &everywhere});
  const int32_t* index = args.index.data<int32_t>();
  parallel_for(n, row_grain(o * k), [&](int64_t from, int64_t to) HWY_ATTR {
    for (int64_t t = from * o; t < to * o; ++t) {
      const T at_peak = f.peak.data<T>()[t];
      T* row = out.data<T>() + (t / o * v + index[t]) * k;
      for (int64_t i = 0; i < k; ++i) row[i] += at_peak * w[t % o * k + i];
    }
  });
}

template <class T>
void backward(const PooledNormGradArgs& args) {
  const Factors f = factors<T>(args);
  weight_gradient<T>(args, f);
  input_gradient<T>(args, f);
}

}  // namespace

void pooled_norm(const PooledNormArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR { forward<decltype(zero)>(args); });
}

void pooled_norm_grad(const PooledNormGradArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR { backward<decltype(zero)>(args); });
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace restage::cpu {
RESTAGE_KERNEL(pooled_norm, PooledNormArgs)
RESTAGE_KERNEL(pooled_norm_grad, PooledNormGradArgs)
}  // namespace restage::cpu
#endif
