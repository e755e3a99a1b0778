// Conversions of one rotation (spec 3.4), for kernels of any device that Eigen compiles for.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace restage::rotation_rows {

constexpr double kEps = 1e-8;

template <class T>
using V3 = Eigen::Matrix<T, 3, 1>;
template <class T>
using M3 = Eigen::Matrix<T, 3, 3, Eigen::RowMajor>;

/// v / max(|v|, eps) and its gradient (if |v| is below eps, the gradient of v / eps).
template <class V>
EIGEN_DEVICE_FUNC V unit(const V& v) {
  using T = typename V::Scalar;
  return v / std::max(v.norm(), static_cast<T>(kEps));
}
template <class V>
EIGEN_DEVICE_FUNC V unit_grad(const V& v, const V& g) {
  using T = typename V::Scalar;
  const T n = v.norm();
  if (n < static_cast<T>(kEps)) return g / static_cast<T>(kEps);
  const V u = v / n;
  return (g - u * u.dot(g)) / n;
}

template <class T>
EIGEN_DEVICE_FUNC M3<T> from_sixd(const T* x) {
  const V3<T> a1(x[0], x[1], x[2]), a2(x[3], x[4], x[5]);
  const V3<T> b1 = unit(a1);
  const V3<T> b2 = unit(V3<T>(a2 - b1.dot(a2) * b1));
  M3<T> r;
  r << b1, b2, b1.cross(b2);
  return r;
}

template <class T>
EIGEN_DEVICE_FUNC void sixd_grad(const T* x, const M3<T>& g, T* out) {
  const V3<T> a1(x[0], x[1], x[2]), a2(x[3], x[4], x[5]);
  const V3<T> b1 = unit(a1);
  const V3<T> u = a2 - b1.dot(a2) * b1, b2 = unit(u);
  const V3<T> g3 = g.col(2);
  V3<T> g1 = g.col(0), g2 = g.col(1);
  g1 += b2.cross(g3);
  g2 += g3.cross(b1);
  const V3<T> gu = unit_grad(u, g2);
  const T along = b1.dot(gu);
  const V3<T> ga2 = gu - along * b1;
  g1 -= along * a2 + b1.dot(a2) * gu;
  const V3<T> ga1 = unit_grad(a1, g1);
  for (int i = 0; i < 3; ++i) {
    out[i] = ga1[i];
    out[3 + i] = ga2[i];
  }
}

template <class T>
EIGEN_DEVICE_FUNC M3<T> from_quaternion(const T* in) {
  using Q = Eigen::Matrix<T, 4, 1>;
  const Q q = unit(Q(in[0], in[1], in[2], in[3]));
  const T w = q[0], x = q[1], y = q[2], z = q[3];
  M3<T> r;
  r << 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),  //
      2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),   //
      2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y);
  return r;
}

template <class T>
EIGEN_DEVICE_FUNC void quaternion_grad(const T* in, const M3<T>& g, T* out) {
  using Q = Eigen::Matrix<T, 4, 1>;
  const Q raw(in[0], in[1], in[2], in[3]), q = unit(raw);
  const T w = q[0], x = q[1], y = q[2], z = q[3];
  Q gq;
  gq[0] = 2 * (-z * g(0, 1) + y * g(0, 2) + z * g(1, 0) - x * g(1, 2) - y * g(2, 0) + x * g(2, 1));
  gq[1] = 2 * (y * g(0, 1) + z * g(0, 2) + y * g(1, 0) - 2 * x * g(1, 1) - w * g(1, 2) +
               z * g(2, 0) + w * g(2, 1) - 2 * x * g(2, 2));
  gq[2] = 2 * (-2 * y * g(0, 0) + x * g(0, 1) + w * g(0, 2) + x * g(1, 0) + z * g(1, 2) -
               w * g(2, 0) + z * g(2, 1) - 2 * y * g(2, 2));
  gq[3] = 2 * (-2 * z * g(0, 0) - w * g(0, 1) + x * g(0, 2) + w * g(1, 0) - 2 * z * g(1, 1) +
               y * g(1, 2) + x * g(2, 0) + y * g(2, 1));
  const Q result = unit_grad(raw, gq);
  for (int i = 0; i < 4; ++i) out[i] = result[i];
}

/// sin(t)/t, (1 - cos t)/t^2 and their derivatives divided by t; Taylor below 1e-4 rad.
template <class T>
struct Rodrigues {
  T s, c, ds, dc;
  EIGEN_DEVICE_FUNC explicit Rodrigues(T t2) {
    if (t2 < T(1e-8)) {
      s = 1 - t2 / 6;
      c = T(0.5) - t2 / 24;
      ds = T(-1) / 3;
      dc = T(-1) / 12;
      return;
    }
    const T t = std::sqrt(t2), half = std::sin(t / 2);
    s = std::sin(t) / t;
    c = 2 * half * half / t2;  // 1 - cos t, without cancellation
    ds = (std::cos(t) - s) / t2;
    dc = (s - 2 * c) / t2;
  }
};

template <class T>
EIGEN_DEVICE_FUNC M3<T> skew(const T* w) {
  M3<T> k;
  k << 0, -w[2], w[1], w[2], 0, -w[0], -w[1], w[0], 0;
  return k;
}

template <class T>
EIGEN_DEVICE_FUNC M3<T> from_axis_angle(const T* w) {
  const Rodrigues<T> f(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
  const M3<T> k = skew(w);
  return M3<T>::Identity() + f.s * k + f.c * k * k;
}

template <class T>
EIGEN_DEVICE_FUNC void axis_angle_grad(const T* w, const M3<T>& g, T* out) {
  const Rodrigues<T> f(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
  const M3<T> k = skew(w), k2 = k * k;
  const T gs = (g.array() * k.array()).sum(), gc = (g.array() * k2.array()).sum();
  // d(k*k) = dk k + k dk
  const M3<T> gk = f.s * g + f.c * (g * k.transpose() + k.transpose() * g);
  const T d[3] = {gk(2, 1) - gk(1, 2), gk(0, 2) - gk(2, 0), gk(1, 0) - gk(0, 1)};
  for (int i = 0; i < 3; ++i) out[i] = d[i] + (gs * f.ds + gc * f.dc) * w[i];
}

template <class T>
EIGEN_DEVICE_FUNC void to_quaternion(const T* m, T* q) {
  const T xx = m[0], yy = m[4], zz = m[8];
  const T t[4] = {1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz};
  const T a = m[7] - m[5], b = m[2] - m[6], c = m[3] - m[1];
  const T d = m[3] + m[1], e = m[2] + m[6], f = m[7] + m[5];
  const T rows[4][4] = {{t[0], a, b, c}, {a, t[1], d, e}, {b, d, t[2], f}, {c, e, f, t[3]}};
  const auto best = std::max_element(t, t + 4) - t;
  T n = 0;
  for (int i = 0; i < 4; ++i) n += rows[best][i] * rows[best][i];
  n = std::max(std::sqrt(n), static_cast<T>(kEps));
  const T sign = rows[best][0] < 0 ? T(-1) : T(1);
  for (int i = 0; i < 4; ++i) q[i] = sign * rows[best][i] / n;
}

template <class T>
EIGEN_DEVICE_FUNC void to_axis_angle(const T* m, T* out) {
  T q[4];
  to_quaternion(m, q);
  const T n = std::sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const T angle = 2 * std::atan2(n, q[0]);
  const T k = n < T(1e-8) ? T(2) : angle / std::max(n, T(1e-12));
  for (int i = 0; i < 3; ++i) out[i] = k * q[1 + i];
}

}  // namespace restage::rotation_rows
