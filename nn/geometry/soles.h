// The soles of a body: which points of its surface touch the floor first, and where a pose puts
// them.
#pragma once

#include <array>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

/// Of `some` of the points, those farthest out in 26 directions, in ascending order.
std::vector<int32_t> outermost(const Points& points, const std::vector<int32_t>& some);

class Soles {
 public:
  /// `mesh` in T-pose with its joints at `rest`. A vertex belongs to a foot if the ankle and the
  /// foot joint of that side move it by more than half.
  Soles(const Mesh& mesh, const Joints& rest, const SkinWeights& weights);
  /// Without a surface: the foot joints themselves, as high over the floor as they rest.
  explicit Soles(const Joints& rest);

  /// Height of the lowest point of the left and of the right foot, metres. A foot without vertices
  /// has its joint for a sole.
  std::array<double, 2> lowest(const PosedSkeleton& posed) const;

 private:
  struct Spot {
    Vec3 place;  ///< in T-pose
    std::array<float, kJoints> weights;
  };
  Joints rest_;
  std::array<std::vector<Spot>, 2> feet_;
};

/// How far each sole lies under `floor` (heights for left and right), metres; 0: it does not.
std::array<double, 2> depths(const std::array<double, 2>& floor, const Soles& soles,
                             const Joints& rest, const Pose& pose);
/// How far a foot can be raised before its knee is folded, metres.
double most_lift(const Joints& rest, int side, const Pose& pose);
/// How far a foot can be lowered before its knee is straight, metres.
double most_drop(const Joints& rest, int side, const Pose& pose);
/// Raises the feet, each as far as its knee lets it: hip and knee give way, the foot keeps its
/// orientation. Below zero they are lowered, until the knee is nearly straight.
void raise_feet(const std::array<double, 2>& by, const Joints& rest, Pose* pose);

}  // namespace restage
