// Implicit surfaces of the built-in bodies: smooth unions of a few shapes, negative inside. The
// shapes are given for the left half (x >= 0) and mirrored by folding x, so bodies are symmetric.
#pragma once

#include <vector>

#include "nn/geometry/skeleton.h"

namespace restage {

/// Cross-section of a loft: an ellipse with half-sizes a, b around (ca, cb) at place t on the axis.
struct Ring {
  double t, a, b, ca, cb;
};

/// Adds shapes one after the other to a signed field; every shape says how softly it blends.
/// Lengths in any one unit. Values are close to distances near the surface and bounds far away.
class ImplicitSurface {
 public:
  /// Ellipses along an axis (0: x with a = y, b = z; 1: y with a = x, b = z; 2: z with a = x,
  /// b = y), rings in ascending t, smoothly interpolated. `keep_left` > 0 cuts away x < keep_left.
  void add_loft(int axis, std::vector<Ring> rings, double blend, double keep_left = 0);
  /// A ball of radius ra at a that turns into one of radius rb at b.
  void add_cone(const Vec3& a, double ra, const Vec3& b, double rb, double blend);
  void add_ellipsoid(const Vec3& centre, const Vec3& radii, double blend);
  /// Removes an ellipsoid softly from everything added before.
  void carve_ellipsoid(const Vec3& centre, const Vec3& radii, double blend);
  /// Cuts everything below y = floor.
  void set_floor(double y) { floor_ = y; }

  double operator()(const Vec3& p) const;
  /// Central differences.
  Vec3 gradient(const Vec3& p) const;

 private:
  enum class Kind { kLoft, kCone, kEllipsoid, kCarve };
  struct Shape {
    Kind kind;
    double blend;
    Vec3 lo, hi;              // box around the shape, grown by nothing
    int axis = 0;             // loft
    double keep_left = 0;     // loft
    std::vector<Ring> rings;  // loft
    Vec3 a, b;                // cone ends, or centre and radii
    double ra = 0, rb = 0;    // cone
  };
  static double loft_distance(const Shape& s, const Vec3& p);
  static double distance(const Shape& s, const Vec3& p);

  std::vector<Shape> shapes_;
  double floor_ = -1e9;
};

}  // namespace restage
