// Where a point is about a body: on which place of which part, and how far over its surface. The
// same place can then be found on another body.
#pragma once

#include <array>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

/// Parts of a body, left before right.
enum class BodyPart {
  belly,
  chest,
  head,
  left_thigh,
  right_thigh,
  left_shin,
  right_shin,
  left_foot,
  right_foot,
  left_upper_arm,
  right_upper_arm,
  left_forearm,
  right_forearm,
  left_hand,
  right_hand
};
inline constexpr int kParts = 15;

/// A place about a part, whose axis is a line from one joint to another: `along` is 0 to 1 where
/// the place is beside the axis, -1 to 0 or 1 to 2 where it lies beyond its beginning or its end
/// (by an angle of up to 90 degrees); `around` is an angle from the body's front, radians.
struct PlaceOnPart {
  double along, around;
};

struct NearPart {
  PlaceOnPart place;
  double over;  ///< metres from the surface; negative: inside
  Vec3 out;     ///< the direction away from the axis, in the world
};

/// The surface of each part as its distance from the part's axis, by place. It turns with one
/// joint, so it is rigid, and it is seen from the axis, so folds of it are not: a few millimetres
/// on bare bodies.
class PartSurfaces {
 public:
  /// `mesh` in T-pose with its joints at `rest`. A vertex belongs to the part whose joints move it
  /// most. A part without vertices is as thin as its axis.
  PartSurfaces(const Mesh& mesh, const Joints& rest, const SkinWeights& weights);

  /// `size`: how much larger the body is than that of the constructor. The axes need no size: they
  /// lie where the joints are, but for those of head, feet and hands, which end without a joint.
  NearPart locate(BodyPart part, const PosedSkeleton& posed, const Vec3& point,
                  double size = 1) const;
  /// The point `over` metres over the surface of that place.
  Vec3 point(BodyPart part, const PosedSkeleton& posed, const PlaceOnPart& place, double over,
             double size = 1) const;
  /// A share of the way from the wrist to the finger tips of a hand.
  Vec3 on_hand(int side, const PosedSkeleton& posed, double share, double size = 1) const;
  /// How far the surface of a hand lies from such a point, in direction `out`, metres.
  double hand_radius(int side, const PosedSkeleton& posed, double share, const Vec3& out,
                     double size = 1) const;

 private:
  static constexpr int kAlong = 13, kAround = 12;
  struct Shape {
    Vec3 end = Vec3::Zero();     ///< of the axis from its beginning, in the turning joint's axes
    Vec3 front = Vec3::UnitZ();  ///< from which `around` counts, in the same axes
    std::array<std::array<double, kAround>, kAlong> radius{};  ///< metres
  };
  struct Axis {
    Vec3 begin, way, front, side;
    double length;
  };
  struct Found {
    PlaceOnPart place;
    Vec3 out;
    double from_axis;
  };
  Axis axis(BodyPart part, const PosedSkeleton& posed, double size) const;
  static Found find(const Axis& axis, const Vec3& point);
  void measure(BodyPart part, const PosedSkeleton& rest, const Points& points);
  static void fill(Shape* shape,
                   const std::array<std::array<std::vector<double>, kAround>, kAlong>&);
  double radius(BodyPart part, const PlaceOnPart& place) const;

  std::array<Shape, kParts> shapes_;
};

}  // namespace restage
