// Swing and twist of one skeleton (kernels/rotation.h): a few small products a joint, in double;
// for kernels of any device that Eigen compiles for.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

#include "autograd/kernels/rotation.h"

namespace restage::swing_rows {

using Vec = Eigen::Vector3d;
using Mat = Eigen::Matrix3d;

constexpr double kTiny = 1e-9;      // metres: a shorter vector has no direction
constexpr double kReversed = 1e-2;  // 1 + cosine below which an arc has no gradient (172 degrees)

/// NaN stays NaN.
EIGEN_DEVICE_FUNC inline double not_tiny(double length) {
  return length < kTiny ? double{kTiny} : length;
}

template <class T>
EIGEN_DEVICE_FUNC Vec vec_at(const T* p) {
  return Eigen::Map<const Eigen::Matrix<T, 3, 1>>(p).template cast<double>();
}
template <class T>
EIGEN_DEVICE_FUNC Mat mat_at(const T* p) {
  return Eigen::Map<const Eigen::Matrix<T, 3, 3, Eigen::RowMajor>>(p).template cast<double>();
}

EIGEN_DEVICE_FUNC inline Mat cross_matrix(const Vec& v) {
  Mat m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}
/// The gradient of v from the gradient of cross_matrix(v).
EIGEN_DEVICE_FUNC inline Vec from_cross(const Mat& g) {
  return {g(2, 1) - g(1, 2), g(0, 2) - g(2, 0), g(1, 0) - g(0, 1)};
}
/// The gradient of x from the gradient of its direction u = x / length.
EIGEN_DEVICE_FUNC inline Vec from_direction(const Vec& g, const Vec& u, double length) {
  return (g - u * u.dot(g)) / length;
}

/// Axes: x along `across`, y along the part of `up` at right angles to x, z at right angles to
/// both.
struct Frame {
  EIGEN_DEVICE_FUNC Frame(const Vec& across, const Vec& upwards)
      : length(across.norm()), up(upwards) {
    x = across / not_tiny(length);
    const Vec rest = up - x.dot(up) * x;
    height = rest.norm();
    good = length > kTiny && height > 1e-6 * up.norm() && height > kTiny;
    y = rest / not_tiny(height);
  }
  EIGEN_DEVICE_FUNC Mat matrix() const {
    Mat m;
    m << x, y, x.cross(y);
    return m;
  }
  EIGEN_DEVICE_FUNC void grad(const Mat& g, Vec* g_across, Vec* g_up) const {
    const Vec gz = g.col(2), gy = g.col(1) + gz.cross(x);
    const Vec g_rest = from_direction(gy, y, height);
    *g_up = g_rest - x * x.dot(g_rest);
    const Vec gx = g.col(0) + y.cross(gz) - x.dot(up) * g_rest - up * x.dot(g_rest);
    *g_across = from_direction(gx, x, length);
  }
  double length, height;
  Vec up, x, y;
  bool good;
};

/// Gradient of the rotation of least angle from a to b.
EIGEN_DEVICE_FUNC inline void arc_grad(const Vec& a, const Vec& b, const Mat& g, Vec* ga, Vec* gb) {
  ga->setZero();
  gb->setZero();
  const double c = a.dot(b), k = 1 + c;
  if (k < kReversed) return;
  const Vec v = a.cross(b);  // the matrix is c + [v] + v v' / (1 + c)
  const double gc = g.trace() - v.dot(g * v) / (k * k);
  const Vec gv = from_cross(g) + (g + g.transpose()) * v / k;
  *ga = b.cross(gv) + gc * b;
  *gb = gv.cross(a) + gc * a;
}

EIGEN_DEVICE_FUNC inline Mat turn(const Vec& axis, double angle) {
  return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
}
EIGEN_DEVICE_FUNC inline void turn_grad(const Vec& u, double angle, const Mat& g, Vec* gu,
                                        double* g_angle) {
  const double s = std::sin(angle), c = std::cos(angle);
  *g_angle =
      (g.cwiseProduct(-s * Mat::Identity() + c * cross_matrix(u) + s * u * u.transpose())).sum();
  *gu = s * from_cross(g) + (1 - c) * (g + g.transpose()) * u;
}

/// How many doubles for each joint a walk needs as working memory: forwards, and forwards and back.
inline constexpr int64_t kWalkRoom = 9, kWalkBackRoom = 24;

/// One skeleton: world rotations on the way down, gradients on the way up. Arc{}(a, b) is the
/// rotation of least angle from unit vector a to unit vector b, about any axis if they are
/// opposite.
template <class T, class Arc>
struct Walk {
  EIGEN_DEVICE_FUNC Walk(const SwingJoint* of, int64_t n, const T* at_rest, const T* as_posed,
                         const T* twisted, double* room)
      : joints(of),
        count(n),
        rest(at_rest),
        posed(as_posed),
        twist(twisted),
        world(reinterpret_cast<Mat*>(room)) {
    for (int64_t j = 0; j < count; ++j) world[j] = rotation(joints[j], static_cast<int>(j));
  }
  EIGEN_DEVICE_FUNC Mat above(const SwingJoint& joint) const {
    return joint.parent < 0 ? Mat(Mat::Identity()) : world[joint.parent];
  }
  EIGEN_DEVICE_FUNC static Vec bone(const T* x, int from, int to) {
    return vec_at(x + 3 * to) - vec_at(x + 3 * from);
  }
  EIGEN_DEVICE_FUNC static Frame frame(const T* x, const SwingJoint& s, int j) {
    return {bone(x, s.right, s.left), bone(x, j, s.child)};
  }
  EIGEN_DEVICE_FUNC Mat rotation(const SwingJoint& s, int j) const {
    const Mat parent = above(s);
    if (s.child < 0) return parent;
    if (s.left >= 0) {
      const Frame a = frame(rest, s, j), b = frame(posed, s, j);
      return a.good && b.good ? Mat(b.matrix() * a.matrix().transpose()) : parent;
    }
    const Vec from = parent * bone(rest, j, s.child), to = bone(posed, j, s.child);
    if (from.norm() <= kTiny || to.norm() <= kTiny) return parent;
    const Vec b = to.normalized();
    return turn(b, static_cast<double>(twist[j])) * Arc{}(from.normalized(), b) * parent;
  }
  EIGEN_DEVICE_FUNC void write(T* out) const {
    for (int64_t j = 0; j < count; ++j) {
      const Mat local = above(joints[j]).transpose() * world[j];
      Eigen::Map<Eigen::Matrix<T, 3, 3, Eigen::RowMajor>>(out + 9 * j) = local.template cast<T>();
    }
  }

  const SwingJoint* joints;
  int64_t count;
  const T *rest, *posed, *twist;
  Mat* world;
};

template <class T, class Arc>
struct WalkBack : Walk<T, Arc> {
  using Down = Walk<T, Arc>;
  using Down::joints, Down::count, Down::rest, Down::posed, Down::twist, Down::world;
  EIGEN_DEVICE_FUNC WalkBack(const SwingJoint* of, int64_t n, const T* at_rest, const T* as_posed,
                             const T* twisted, double* room)
      : Down(of, n, at_rest, as_posed, twisted, room),
        g(world + n),
        g_rest(reinterpret_cast<Vec*>(room + 18 * n)),
        g_posed(g_rest + n) {}

  EIGEN_DEVICE_FUNC void run(const T* gy, T* to_rest, T* to_posed, T* to_twist) {
    for (int64_t j = 0; j < count; ++j) {
      g[j].setZero();
      g_rest[j].setZero();
      g_posed[j].setZero();
    }
    for (int64_t j = count; j-- > 0;) {
      const SwingJoint& s = joints[j];
      const Mat gl = mat_at(gy + 9 * j), parent = this->above(s);
      g[j] += parent * gl;  // local = parent' world
      Mat g_parent = world[j] * gl.transpose();
      to_twist[j] = static_cast<T>(back(s, static_cast<int>(j), g[j], parent, &g_parent));
      if (s.parent >= 0) g[s.parent] += g_parent;
    }
    for (int64_t j = 0; j < count; ++j) {
      Eigen::Map<Eigen::Matrix<T, 3, 1>>(to_rest + 3 * j) = g_rest[j].template cast<T>();
      Eigen::Map<Eigen::Matrix<T, 3, 1>>(to_posed + 3 * j) = g_posed[j].template cast<T>();
    }
  }

 private:
  EIGEN_DEVICE_FUNC static void add_bone(Vec* to, int from, int end, const Vec& value) {
    to[end] += value;
    to[from] -= value;
  }
  EIGEN_DEVICE_FUNC static void add_frame(Vec* to, const SwingJoint& s, int j, const Frame& f,
                                          const Mat& gf) {
    Vec across, up;
    f.grad(gf, &across, &up);
    add_bone(to, s.right, s.left, across);
    add_bone(to, j, s.child, up);
  }
  /// Takes the gradient of a joint's world rotation to the gradients of what the rotation was made
  /// of; returns the gradient of the twist.
  EIGEN_DEVICE_FUNC double back(const SwingJoint& s, int j, const Mat& gw, const Mat& parent,
                                Mat* g_parent) {
    if (s.child >= 0 && s.left >= 0) {
      const Frame a = this->frame(rest, s, j), b = this->frame(posed, s, j);
      if (a.good && b.good) {
        add_frame(g_posed, s, j, b, gw * a.matrix());
        add_frame(g_rest, s, j, a, gw.transpose() * b.matrix());
        return 0;
      }
    } else if (s.child >= 0) {
      const Vec bone = this->bone(rest, j, s.child), from = parent * bone;
      const Vec to = this->bone(posed, j, s.child);
      if (from.norm() > kTiny && to.norm() > kTiny) {
        const Vec a = from.normalized(), b = to.normalized();
        const double angle = static_cast<double>(twist[j]);
        const Mat swing = Arc{}(a, b), swung = swing * parent, t = turn(b, angle);
        Vec gu, ga, gb;
        double g_angle = 0;
        turn_grad(b, angle, gw * swung.transpose(), &gu, &g_angle);
        const Mat g_swung = t.transpose() * gw;
        arc_grad(a, b, g_swung * parent.transpose(), &ga, &gb);
        add_bone(g_posed, j, s.child, from_direction(gu + gb, b, to.norm()));
        const Vec g_from = from_direction(ga, a, from.norm());
        *g_parent += swing.transpose() * g_swung + g_from * bone.transpose();
        add_bone(g_rest, j, s.child, parent.transpose() * g_from);
        return g_angle;
      }
    }
    *g_parent += gw;
    return 0;
  }

  Mat* g;
  Vec *g_rest, *g_posed;
};

}  // namespace restage::swing_rows
