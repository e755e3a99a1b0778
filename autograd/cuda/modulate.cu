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

/// A pass as a kernel sees it.
template <class T>
struct Modulated {
  explicit Modulated(const ModulateGradArgs& a)
      : x(at<T>(a.x)),
        mesh(at<T>(a.mesh)),
        gy(at<T>(a.gy)),
        factor{at<T>(a.scale), at<T>(a.scale_bias)},
        shift{at<T>(a.shift), at<T>(a.shift_bias)},
        c(a.x.size(2)),
        points_of_x(a.x.size(1) == a.mesh.size(1) ? 1 : a.mesh.size(1)),
        relu(a.activation == Activation::relu) {}
  RESTAGE_DEVICE T input(int64_t r, int64_t i) const {
    return x[(points_of_x == 1 ? r : r / points_of_x) * c + i];
  }
  /// The gradient before the activation, at a point and a channel.
  RESTAGE_DEVICE T gradient(int64_t r, int64_t i) const {
    const T* point = mesh + 3 * r;
    const bool off = relu && factor.at(point, i) * input(r, i) + shift.at(point, i) <= T(0);
    return off ? T(0) : gy[r * c + i];
  }
  const T *x, *mesh, *gy;
  AffineOfPoint<T> factor, shift;
  int64_t c, points_of_x;
  bool relu;
};

template <class T>
void mesh_grad(const ModulateGradArgs& a, const Modulated<T>& of) {
  const T *scale = of.factor.weight, *shift = of.shift.weight;
  T* out = at<T>(*a.g_mesh);
  sums<Sums<3>>(
      a.out, a.mesh.size(0) * a.mesh.size(1), of.c, 1,
      [=] RESTAGE_DEVICE(int64_t r, int64_t i, int64_t) {
        const T g = of.gradient(r, i), x = of.input(r, i);
        Sums<3> s;
        for (int k = 0; k < 3; ++k)
          s.of[k] = static_cast<double>(g * (x * scale[3 * i + k] + shift[3 * i + k]));
        return s;
      },
      [=] RESTAGE_DEVICE(int64_t r, const Sums<3>& total) {
        for (int k = 0; k < 3; ++k) out[3 * r + k] = static_cast<T>(total.of[k]);
      });
}

/// Gradients of both weights and biases: eight sums over all points.
template <class T>
void weight_grads(const ModulateGradArgs& a, const Modulated<T>& of) {
  T *g_scale = at<T>(a.g_scale), *g_scale_bias = at<T>(a.g_scale_bias), *g_shift = at<T>(a.g_shift),
    *g_shift_bias = at<T>(a.g_shift_bias);
  sums<Sums<8>>(
      a.out, 1, a.mesh.size(0) * a.mesh.size(1), of.c,
      [=] RESTAGE_DEVICE(int64_t, int64_t r, int64_t i) {
        const double g = static_cast<double>(of.gradient(r, i)),
                     gx = g * static_cast<double>(of.input(r, i));
        const T* p = of.mesh + 3 * r;
        return Sums<8>{{gx * p[0], gx * p[1], gx * p[2], gx, g * p[0], g * p[1], g * p[2], g}};
      },
      [=] RESTAGE_DEVICE(int64_t i, const Sums<8>& total) {
        for (int k = 0; k < 3; ++k) {
          g_scale[3 * i + k] = static_cast<T>(total.of[k]);
          g_shift[3 * i + k] = static_cast<T>(total.of[4 + k]);
        }
        g_scale_bias[i] = static_cast<T>(total.of[3]);
        g_shift_bias[i] = static_cast<T>(total.of[7]);
      });
}

template <class T>
void modulate_grad_of(const ModulateGradArgs& a) {
  const int64_t n = a.x.size(0), v = a.mesh.size(1), c = a.x.size(2);
  const Modulated<T> of(a);
  T* out = at<T>(a.out);
  if (of.points_of_x == 1) {
    rows(n * v, c, [=] RESTAGE_DEVICE(int64_t r, int64_t i) {
      out[r * c + i] = of.gradient(r, i) * of.factor.at(of.mesh + 3 * r, i);
    });
  } else {
    sums(
        a.out, n, v, c,
        [=] RESTAGE_DEVICE(int64_t o, int64_t p, int64_t i) {
          const int64_t r = o * v + p;
          return static_cast<double>(of.gradient(r, i) * of.factor.at(of.mesh + 3 * r, i));
        },
        [=] RESTAGE_DEVICE(int64_t k, double total) { out[k] = static_cast<T>(total); });
  }
  weight_grads<T>(a, of);
  if (a.g_mesh != nullptr) mesh_grad<T>(a, of);
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
