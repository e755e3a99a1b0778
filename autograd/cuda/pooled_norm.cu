// Linear map, batch norm and maximum over points (kernels/pooled_norm.h), with the algebra of
// cpu/pooled_norm.cpp: cuBLAS makes the product of some clouds at a time, one pass goes over it,
// and the backward pass has no product as large as that.
#include "autograd/cuda/indices.h"
#include "autograd/cuda/kernels.h"
#include "autograd/cuda/sums.h"

namespace restage::cuda {
namespace {

constexpr int64_t kProducts = 1 << 24;  ///< numbers of the product that are there at once
constexpr int64_t kStretch = 256;       ///< points that a thread goes through

/// Sizes as kernels need them.
struct Sizes {
  Sizes(const Tensor& x, int64_t channels)
      : n(x.size(0)), v(x.size(1)), k(x.size(2)), o(channels) {}
  int64_t n, v, k, o;
};

/// Computes x less its mean over all points, and the mean [1, k].
template <class T>
void centre(const PooledNormArgs& args, const Sizes& s, const Tensor& mean) {
  const int64_t rows = s.n * s.v, k = s.k;
  Tensor room = scratch(args.out, k);
  double* total = at<double>(room);
  const T* x = at<T>(args.x);
  T *m = at<T>(mean), *h = at<T>(args.centred);
  sums(args.out, 1, rows, k, total, [=] RESTAGE_DEVICE(int64_t, int64_t r, int64_t i) {
    return static_cast<double>(x[r * k + i]);
  });
  each(k, [=] RESTAGE_DEVICE(int64_t i) {
    m[i] = static_cast<T>(total[i] / static_cast<double>(rows));
  });
  each(rows * k, [=] RESTAGE_DEVICE(int64_t i) { h[i] = x[i] - m[i % k]; });
}

/// Of the product z of clouds from `first` on: where a channel is largest (or smallest, by the sign
/// of its scale), its value there, and the sums of its squares [n, o].
template <class T>
void find_peaks(const PooledNormArgs& args, const Sizes& s, const Tensor& z, int64_t first,
                int64_t clouds, double* squares) {
  const int64_t v = s.v, o = s.o, parts = (v + kStretch - 1) / kStretch, all = clouds * parts * o;
  Tensor room = scratch(args.out, 3 * all);
  double *best = at<double>(room), *where = best + all, *square = where + all;
  const T *of = at<T>(z), *scale = at<T>(args.scale);
  each(all, [=] RESTAGE_DEVICE(int64_t i) {
    const int64_t c = i % o, p = i / o % parts, cloud = i / (o * parts);
    const int64_t end = v < (p + 1) * kStretch ? v : (p + 1) * kStretch;
    const double sign = scale[c] > T(0) ? 1 : scale[c] < T(0) ? -1 : 0;
    double top = -INFINITY, at_top = static_cast<double>(p * kStretch), sum = 0;
    for (int64_t r = p * kStretch; r < end; ++r) {
      const double value = static_cast<double>(of[(cloud * v + r) * o + c]);
      if (sign * value > top) top = sign * value, at_top = static_cast<double>(r);
      sum += value * value;
    }
    best[i] = top, where[i] = at_top, square[i] = sum;
  });
  int32_t* index = at<int32_t>(args.index) + first * o;
  T* peak = at<T>(args.peak) + first * o;
  double* total = squares + first * o;
  each(clouds * o, [=] RESTAGE_DEVICE(int64_t i) {
    const int64_t c = i % o, cloud = i / o;
    double top = -INFINITY, at_top = 0, sum = 0;
    for (int64_t p = 0; p < parts; ++p) {
      const int64_t from = (cloud * parts + p) * o + c;
      if (best[from] > top) top = best[from], at_top = where[from];
      sum += square[from];
    }
    index[i] = static_cast<int32_t>(at_top);
    peak[i] = of[(cloud * v + static_cast<int64_t>(at_top)) * o + c];
    total[i] = sum;
  });
}

/// Statistics of the channels, and the result from the maxima.
template <class T>
void finish(const PooledNormArgs& args, const Sizes& s, const double* squares, const Tensor& mean) {
  const int64_t n = s.n, o = s.o;
  const double rows = static_cast<double>(n * s.v), eps = args.eps;
  const T *z_mean = at<T>(mean), *scale = at<T>(args.scale), *shift = at<T>(args.shift),
          *bias = at<T>(args.bias);
  double *out_mean = at<double>(args.mean), *variance = at<double>(args.variance),
         *rstd = at<double>(args.rstd);
  each(o, [=] RESTAGE_DEVICE(int64_t c) {
    double total = 0;
    for (int64_t cloud = 0; cloud < n; ++cloud) total += squares[cloud * o + c];
    // What is not finite must stay visible, also from points that are no maximum.
    variance[c] = total - total == 0 ? total / rows : static_cast<double>(NAN);
    rstd[c] = 1.0 / sqrt(variance[c] + eps);
    out_mean[c] = static_cast<double>(z_mean[c]);
  });
  const bool relu = args.activation == Activation::relu;
  T *peak = at<T>(args.peak), *out = at<T>(args.out);
  each(n * o, [=] RESTAGE_DEVICE(int64_t i) {
    const int64_t c = i % o;
    const T none = bias[c] - bias[c];  // NaN from a bias that is not finite
    const double xhat = static_cast<double>(peak[i]) * rstd[c];
    const T y =
        static_cast<T>(xhat * static_cast<double>(scale[c]) + static_cast<double>(shift[c] + none));
    peak[i] = static_cast<T>(xhat);
    out[i] = relu && y <= T(0) ? T(0) : y;
  });
}

template <class T>
void pooled_norm_of(const PooledNormArgs& args) {
  const Sizes s(args.x, args.out.size(1));
  Tensor x_mean = empty_like(args.out, {1, s.k}), z_mean = empty_like(args.out, {1, s.o});
  centre<T>(args, s, x_mean);
  matmul({.a = x_mean, .b = args.weight, .out = z_mean, .transpose_b = true, .bias = &args.bias});
  Tensor room = scratch(args.out, s.n * s.o);
  double* squares = at<double>(room);
  const int64_t at_once = std::max<int64_t>(1, kProducts / std::max<int64_t>(1, s.v * s.o));
  for (int64_t first = 0; first < s.n; first += at_once) {
    const int64_t clouds = std::min(at_once, s.n - first);
    Tensor z = empty_like(args.out, {clouds * s.v, s.o});
    const Tensor h = args.centred.rows(first, first + clouds).reshape({clouds * s.v, s.k});
    matmul({.a = h, .b = args.weight, .out = z, .transpose_b = true});
    find_peaks<T>(args, s, z, first, clouds, squares);
  }
  finish<T>(args, s, squares, z_mean);
}

// ---- backward ----------------------------------------------------------------------------------

/// What the gradients are made of (cpu/pooled_norm.cpp has the formula).
struct Factors {
  Tensor peak;      ///< [n, o] gradient into z at the maximum
  Tensor constant;  ///< [1, o] gradient into z at all points
  Tensor slope;     ///< [o] gradient into z at all points, per unit of z
};

template <class T>
Factors factors(const PooledNormGradArgs& args, const Sizes& s) {
  Factors f{empty_like(args.gy), empty_like(args.gy, {1, s.o}), empty_like(args.gy, {s.o})};
  const int64_t n = s.n, o = s.o;
  const double rows = static_cast<double>(n * s.v);
  const bool relu = args.activation == Activation::relu;
  const T *gy = at<T>(args.gy), *y = at<T>(args.y), *xhat = at<T>(args.peak),
          *scale = at<T>(args.scale);
  const double* rstd = at<double>(args.rstd);
  T *peak = at<T>(f.peak), *constant = at<T>(f.constant), *slope = at<T>(f.slope),
    *g_scale = at<T>(args.g_scale), *g_shift = at<T>(args.g_shift);
  each(o, [=] RESTAGE_DEVICE(int64_t c) {
    const double a = static_cast<double>(scale[c]) * rstd[c];
    double by_shift = 0, by_scale = 0;
    for (int64_t i = c; i < n * o; i += o) {
      const double g = relu && y[i] <= T(0) ? 0.0 : static_cast<double>(gy[i]);
      by_shift += g;
      by_scale += g * static_cast<double>(xhat[i]);
      peak[i] = static_cast<T>(a * g);
    }
    g_shift[c] = static_cast<T>(by_shift);
    g_scale[c] = static_cast<T>(by_scale);
    constant[c] = static_cast<T>(-a * by_shift / rows);
    slope[c] = static_cast<T>(-a * rstd[c] * by_scale / rows);
  });
  return f;
}

/// g_weight = diag(slope) W G + what the maxima add, G the Gram matrix of the centred input.
template <class T>
void weight_gradient(const PooledNormGradArgs& args, const Sizes& s, const Factors& f) {
  const int64_t n = s.n, v = s.v, k = s.k, o = s.o;
  const Tensor centred = args.centred.reshape({n * v, k});
  Tensor gram = empty_like(args.gy, {k, k});
  matmul({.a = centred, .b = centred, .out = gram, .transpose_a = true});
  matmul({.a = args.weight, .b = gram, .out = args.g_weight});
  const T *h = at<T>(args.centred), *peak = at<T>(f.peak), *slope = at<T>(f.slope);
  const int32_t* index = at<int32_t>(args.index);
  T* g = at<T>(args.g_weight);
  each(o * k, [=] RESTAGE_DEVICE(int64_t i) {
    const int64_t c = i / k, column = i % k;
    T total = slope[c] * g[i];
    for (int64_t cloud = 0; cloud < n; ++cloud) {
      const int64_t from = cloud * o + c;
      total = fma(peak[from], h[(cloud * v + index[from]) * k + column], total);
    }
    g[i] = total;
  });
}

/// out = h M + constant W + what the maxima add, M = W^T diag(slope) W.
template <class T>
void input_gradient(const PooledNormGradArgs& args, const Sizes& s, const Factors& f) {
  const int64_t n = s.n, v = s.v, k = s.k, o = s.o;
  Tensor scaled = empty_like(args.gy, {o, k}), m = empty_like(args.gy, {k, k}),
         everywhere = empty_like(args.gy, {1, k});
  const T *w = at<T>(args.weight), *slope = at<T>(f.slope), *peak = at<T>(f.peak);
  T* by_slope = at<T>(scaled);
  each(o * k, [=] RESTAGE_DEVICE(int64_t i) { by_slope[i] = slope[i / k] * w[i]; });
  matmul({.a = args.weight, .b = scaled, .out = m, .transpose_a = true});
  matmul({.a = f.constant, .b = args.weight, .out = everywhere});
  Tensor rows = args.out.reshape({n * v, k});
  matmul({.a = args.centred.reshape({n * v, k}), .b = m, .out = rows, .bias = &everywhere});
  const Askers list = askers_of(args.index, v);  // channels whose maximum a point is
  const AskersAt askers(list);
  T* out = at<T>(args.out);
  each(n * v * k, [=] RESTAGE_DEVICE(int64_t i) {
    const int64_t column = i % k;
    const double added = askers.sum(i / k, [&](int64_t from) {
      return static_cast<double>(peak[from]) * static_cast<double>(w[from % o * k + column]);
    });
    out[i] = static_cast<T>(static_cast<double>(out[i]) + added);
  });
}

template <class T>
void pooled_norm_grad_of(const PooledNormGradArgs& args) {
  const Sizes s(args.centred, args.gy.size(1));
  const Factors f = factors<T>(args, s);
  weight_gradient<T>(args, s, f);
  input_gradient<T>(args, s, f);
}

}  // namespace

void pooled_norm(const PooledNormArgs& args) {
  RESTAGE_FLOATS(args.out.dtype(), pooled_norm_of, args)
}
void pooled_norm_grad(const PooledNormGradArgs& args) {
  RESTAGE_FLOATS(args.out.dtype(), pooled_norm_grad_of, args)
}

}  // namespace restage::cuda
