#include "datasets/builtin/implicit.h"

#include <algorithm>
#include <cmath>

namespace restage {
namespace {

// Polynomial smooth minimum: equals min(a, b) where they differ by more than k.
double smooth_min(double a, double b, double k) {
  const double h = std::max(k - std::abs(a - b), 0.0) / k;
  return std::min(a, b) - 0.25 * h * h * k;
}

double box_distance(const Vec3& p, const Vec3& lo, const Vec3& hi) {
  return (lo - p).cwiseMax(p - hi).cwiseMax(0.0).norm();
}

// Close to the distance from an ellipse (2-D) or ellipsoid: exact on the surface, right slope.
double ellipse_distance(double x, double y, double a, double b) {
  const double u = x / a, v = y / b;
  const double k0 = std::hypot(u, v), k1 = std::hypot(u / a, v / b);
  return k1 < 1e-9 ? -std::min(a, b) : k0 * (k0 - 1) / k1;
}

double ellipsoid_distance(const Vec3& p, const Vec3& c, const Vec3& r) {
  const Vec3 u = (p - c).cwiseQuotient(r);
  const double k0 = u.norm(), k1 = u.cwiseQuotient(r).norm();
  return k1 < 1e-9 ? -r.minCoeff() : k0 * (k0 - 1) / k1;
}

double cone_distance(const Vec3& p, const Vec3& a, double ra, const Vec3& b, double rb) {
  const Vec3 ab = b - a;
  const double t = std::clamp((p - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0);
  return (p - a - t * ab).norm() - (ra + t * (rb - ra));
}

// Catmull-Rom through rings k-1 .. k+2 at fraction u between k and k+1 (clamped at the ends).
Ring between(const std::vector<Ring>& r, size_t k, double u) {
  const Ring &p1 = r[k], &p2 = r[k + 1], &p0 = r[k > 0 ? k - 1 : 0],
             &p3 = r[std::min(k + 2, r.size() - 1)];
  const double gap = p2.t - p1.t;
  const auto blend = [&](double Ring::*m) {
    const double s1 = gap * (p2.*m - p0.*m) / std::max(p2.t - p0.t, 1e-9);
    const double s2 = gap * (p3.*m - p1.*m) / std::max(p3.t - p1.t, 1e-9);
    const double d = p2.*m - p1.*m;
    return p1.*m + u * (s1 + u * (3 * d - 2 * s1 - s2 + u * (s1 + s2 - 2 * d)));
  };
  const auto size = [&](double Ring::*m) {
    return std::max(blend(m), 0.5 * std::min(p1.*m, p2.*m));
  };
  return {p1.t + u * gap, size(&Ring::a), size(&Ring::b), blend(&Ring::ca), blend(&Ring::cb)};
}

}  // namespace

void ImplicitSurface::add_loft(int axis, std::vector<Ring> rings, double blend, double keep_left) {
  Shape s{Kind::kLoft, blend, Vec3::Constant(1e9), Vec3::Constant(-1e9), axis, keep_left, {},
          {},          {}};
  const int ia = axis == 0 ? 1 : 0, ib = axis == 2 ? 1 : 2;
  for (const Ring& r : rings) {
    const double grow = 1.15;  // the spline may bulge a little over its rings
    s.lo[axis] = std::min(s.lo[axis], r.t);
    s.hi[axis] = std::max(s.hi[axis], r.t);
    s.lo[ia] = std::min(s.lo[ia], r.ca - grow * r.a);
    s.hi[ia] = std::max(s.hi[ia], r.ca + grow * r.a);
    s.lo[ib] = std::min(s.lo[ib], r.cb - grow * r.b);
    s.hi[ib] = std::max(s.hi[ib], r.cb + grow * r.b);
  }
  s.rings = std::move(rings);
  shapes_.push_back(std::move(s));
}

void ImplicitSurface::add_cone(const Vec3& a, double ra, const Vec3& b, double rb, double blend) {
  const double r = std::max(ra, rb);
  Shape s{Kind::kCone, blend, a.cwiseMin(b).array() - r, a.cwiseMax(b).array() + r, 0, 0, {}, a, b};
  s.ra = ra;
  s.rb = rb;
  shapes_.push_back(std::move(s));
}

void ImplicitSurface::add_ellipsoid(const Vec3& centre, const Vec3& radii, double blend) {
  shapes_.push_back(
      {Kind::kEllipsoid, blend, centre - radii, centre + radii, 0, 0, {}, centre, radii});
}

void ImplicitSurface::carve_ellipsoid(const Vec3& centre, const Vec3& radii, double blend) {
  shapes_.push_back({Kind::kCarve, blend, centre - radii, centre + radii, 0, 0, {}, centre, radii});
}

double ImplicitSurface::loft_distance(const Shape& s, const Vec3& p) {
  const std::vector<Ring>& rings = s.rings;
  const double t = std::clamp(p[s.axis], rings.front().t, rings.back().t);
  size_t k = 0;
  while (k + 2 < rings.size() && rings[k + 1].t <= t) ++k;
  const Ring r = between(rings, k, (t - rings[k].t) / (rings[k + 1].t - rings[k].t));
  const int ia = s.axis == 0 ? 1 : 0, ib = s.axis == 2 ? 1 : 2;
  const double side = ellipse_distance(p[ia] - r.ca, p[ib] - r.cb, r.a, r.b);
  const double end = std::max(rings.front().t - p[s.axis], p[s.axis] - rings.back().t);
  const double d =
      std::hypot(std::max(side, 0.0), std::max(end, 0.0)) + std::min(std::max(side, end), 0.0);
  return s.keep_left > 0 ? -smooth_min(-d, p.x() - s.keep_left, 0.02) : d;
}

double ImplicitSurface::distance(const Shape& s, const Vec3& p) {
  switch (s.kind) {
    case Kind::kLoft:
      return loft_distance(s, p);
    case Kind::kCone:
      return cone_distance(p, s.a, s.ra, s.b, s.rb);
    default:
      return ellipsoid_distance(p, s.a, s.b);
  }
}

double ImplicitSurface::operator()(const Vec3& point) const {
  const Vec3 p(std::abs(point.x()), point.y(), point.z());
  double d = 1e3;
  for (const Shape& s : shapes_) {
    const double bound = box_distance(p, s.lo, s.hi);
    if (s.kind == Kind::kCarve) {
      if (bound < s.blend - d) d = -smooth_min(-d, distance(s, p), s.blend);
    } else if (bound < d + s.blend) {  // farther shapes cannot change the smooth minimum
      d = smooth_min(d, distance(s, p), s.blend);
    }
  }
  return std::max(d, floor_ - p.y());
}

Vec3 ImplicitSurface::gradient(const Vec3& p) const {
  const double e = 5e-4;
  Vec3 g;
  for (int i = 0; i < 3; ++i) {
    const Vec3 step = e * Vec3::Unit(i);
    g[i] = ((*this)(p + step) - (*this)(p - step)) / (2 * e);
  }
  return g;
}

}  // namespace restage
