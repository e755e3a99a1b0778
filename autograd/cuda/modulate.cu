// Scales and shifts of every channel that change from point to point (kernels/modulate.h).
#include "autograd/cuda/kernels.h"
#include "autograd/cuda/sums.h"

namespace restage::cuda {
namespace {

/// Factor, or shift, of a channel at a point.
template <class T>
struct AffineOfPoint {
  const T *weight, *bias;
  RESTAGE_DEVICE T at(const T* point, int64_t c) const {
    const T* w = weight + 3 * c;
    return w[0] * point[0] + w[1] * point[1] + w[2] * point[2] + bias[c];
  }
};

template <class T>
void modulate_of(const ModulateArgs& a) {
  const int64_t v = a.mesh.size(1), c = a.x.size(2), rows_of_x = a.x.size(1);
  const T *x = at<T>(a.x), *mesh = at<T>(a.mesh);
  T* out = at<T>(a.out);
  const AffineOfPoint<T> factor{at<T>(a.scale), at<T>(a.scale_bias)},
      shift{at<T>(a.shift), at<T>(a.shift_bias)};
  const bool relu = a.activation == Activation::relu;
  rows(a.x.size(0) * v, c, [=] RESTAGE_DEVICE(int64_t r, int64_t i) {
    const int64_t from = rows_of_x == v ? r : r / v;
    const T y = factor.at(mesh + 3 * r, i) * x[from * c + i] + shift.at(mesh + 3 * r, i);
    out[r * c + i] = relu && y <= 0 ? T(0) : y;
  });
}

/// The gradient before the activation [n, v, c].
template <class T>
Tensor before_activation(const ModulateGradArgs& a) {
  if (a.activation != Activation::relu) return a.gy;
  const int64_t v = a.mesh.size(1), c = a.x.size(2), rows_of_x = a.x.size(1);
  const T *x = at<T>(a.x), *mesh = at<T>(a.mesh), *gy = at<T>(a.gy);
  const AffineOfPoint<T> factor{at<T>(a.scale), at<T>(a.scale_bias)},
      shift{at<T>(a.shift), at<T>(a.shift_bias)};
  Tensor out = empty_like(a.gy);
  T* g = at<T>(out);
  rows(a.x.size(0) * v, c, [=] RESTAGE_DEVICE(int64_t r, int64_t i) {
    const int64_t from = rows_of_x == v ? r : r / v;
    const T y = factor.at(mesh + 3 * r, i) * x[from * c + i] + shift.at(mesh + 3 * r, i);
    g[r * c + i] = y <= 0 ? T(0) : gy[r * c + i];
  });
  return out;
}

/// Gradients of one weight and its bias, of sums over all points of `of(row, channel)`.
template <class T, class F>
void weight_grad(const ModulateGradArgs& a, const T* mesh, T* weight, T* bias, F of) {
  const int64_t all = a.mesh.size(0) * a.mesh.size(1), c = a.x.size(2);
  for (int64_t k = 0; k < 3; ++k)
    sums(
        a.out, 1, all, c,
        [=] RESTAGE_DEVICE(int64_t, int64_t r, int64_t i) { return of(r, i) * mesh[3 * r + k]; },
        [=] RESTAGE_DEVICE(int64_t i, double total) { weight[3 * i + k] = static_cast<T>(total); });
  sums(
      a.out, 1, all, c, [=] RESTAGE_DEVICE(int64_t, int64_t r, int64_t i) { return of(r, i); },
      [=] RESTAGE_DEVICE(int64_t i, double total) { bias[i] = static_cast<T>(total); });
}

template <class T>
void mesh_grad(const ModulateGradArgs& a, const T* g) {
  const int64_t v = a.mesh.size(1), c = a.x.size(2), rows_of_x = a.x.size(1);
  const T *x = at<T>(a.x), *scale = at<T>(a.scale), *shift = at<T>(a.shift);
  T* out = at<T>(*a.g_mesh);
  each(3 * a.mesh.size(0) * v, [=] RESTAGE_DEVICE(int64_t n) {
    const int64_t r = n / 3, k = n % 3, from = rows_of_x == v ? r : r / v;
    double total = 0;
    for (int64_t i = 0; i < c; ++i)
      total += static_cast<double>(g[r * c + i] *
                                   (x[from * c + i] * scale[3 * i + k] + shift[3 * i + k]));
    out[n] = static_cast<T>(total);
  });
}

template <class T>
void modulate_grad_of(const ModulateGradArgs& a) {
  const int64_t n = a.x.size(0), v = a.mesh.size(1), c = a.x.size(2), rows_of_x = a.x.size(1);
  const Tensor before = before_activation<T>(a);
  const T *x = at<T>(a.x), *mesh = at<T>(a.mesh), *g = at<T>(before);
  T* out = at<T>(a.out);
  const AffineOfPoint<T> factor{at<T>(a.scale), at<T>(a.scale_bias)};
  if (rows_of_x == v) {
    rows(n * v, c, [=] RESTAGE_DEVICE(int64_t r, int64_t i) {
      out[r * c + i] = g[r * c + i] * factor.at(mesh + 3 * r, i);
    });
  } else {
    sums(
        a.out, n, v, c,
        [=] RESTAGE_DEVICE(int64_t o, int64_t p, int64_t i) {
          const int64_t r = o * v + p;
          return static_cast<double>(g[r * c + i] * factor.at(mesh + 3 * r, i));
        },
        [=] RESTAGE_DEVICE(int64_t k, double total) { out[k] = static_cast<T>(total); });
  }
  weight_grad(a, mesh, at<T>(a.g_scale), at<T>(a.g_scale_bias),
              [=] RESTAGE_DEVICE(int64_t r, int64_t i) {
                const int64_t from = rows_of_x == v ? r : r / v;
                return static_cast<double>(g[r * c + i]) * static_cast<double>(x[from * c + i]);
              });
  weight_grad(
      a, mesh, at<T>(a.g_shift), at<T>(a.g_shift_bias),
      [=] RESTAGE_DEVICE(int64_t r, int64_t i) { return static_cast<double>(g[r * c + i]); });
  if (a.g_mesh != nullptr) mesh_grad<T>(a, g);
}

template <class T>
void elain_of(const ElainArgs& a) {
  const int64_t v = a.x.size(1), c = a.x.size(2);
  const T *x = at<T>(a.x), *unit = at<T>(a.unit), *gamma = at<T>(a.gamma), *beta = at<T>(a.beta),
          *share = at<T>(a.share);
  T* out = at<T>(a.out);
  const auto slope = static_cast<T>(a.slope);
  rows(a.x.size(0) * v, c, [=] RESTAGE_DEVICE(int64_t r, int64_t i) {
    const int64_t k = r * c + i;
    const T s = share[r / v * c + i];
    const T y = s * (gamma[k] * unit[k] + beta[k]) + (unit[k] + x[k] - s * x[k]);
    out[k] = y > 0 ? y : slope * y;
  });
}

template <class T>
void elain_grad_of(const ElainGradArgs& a) {
  const int64_t n = a.x.size(0), v = a.x.size(1), c = a.x.size(2);
  const T *x = at<T>(a.x), *unit = at<T>(a.unit), *gamma = at<T>(a.gamma), *beta = at<T>(a.beta),
          *share = at<T>(a.share), *gy = at<T>(a.gy);
  T *g_x = at<T>(a.out), *g_unit = at<T>(a.g_unit), *g_gamma = at<T>(a.g_gamma),
    *g_beta = at<T>(a.g_beta), *g_share = at<T>(a.g_share);
  const auto slope = static_cast<T>(a.slope);
  const auto before = [=] RESTAGE_DEVICE(int64_t r,
                                         int64_t i) {  // the gradient before the activation
    const int64_t k = r * c + i;
    const T s = share[r / v * c + i];
    const T y = s * (gamma[k] * unit[k] + beta[k]) + (unit[k] + x[k] - s * x[k]);
    return y > 0 ? gy[k] : slope * gy[k];
  };
  rows(n * v, c, [=] RESTAGE_DEVICE(int64_t r, int64_t i) {
    const int64_t k = r * c + i;
    const T g = before(r, i), of_asked = g * share[r / v * c + i];
    g_x[k] = g - of_asked;
    g_unit[k] = of_asked * gamma[k] + g;
    g_gamma[k] = of_asked * unit[k];
    g_beta[k] = of_asked;
  });
  sums(
      a.g_share, n, v, c,
      [=] RESTAGE_DEVICE(int64_t o, int64_t p, int64_t i) {
        const int64_t r = o * v + p, k = r * c + i;
        return static_cast<double>(before(r, i) * (gamma[k] * unit[k] + beta[k] - x[k]));
      },
      [=] RESTAGE_DEVICE(int64_t k, double total) { g_share[k] = static_cast<T>(total); });
}

}  // namespace

void modulate(const ModulateArgs& args) { RESTAGE_FLOATS(args.out.dtype(), modulate_of, args) }
void modulate_grad(const ModulateGradArgs& args) {
  RESTAGE_FLOATS(args.out.dtype(), modulate_grad_of, args)
}

void elain(const ElainArgs& args) { RESTAGE_FLOATS(args.out.dtype(), elain_of, args) }
void elain_grad(const ElainGradArgs& args) { RESTAGE_FLOATS(args.out.dtype(), elain_grad_of, args) }

}  // namespace restage::cuda
