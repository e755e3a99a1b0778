// A person's own surface, from the clouds of some frames, posed in others: how far the joints and
// rotations of a sequence explain its clouds. No body model and no truth are needed.
#pragma once

#include <optional>
#include <vector>

#include "nn/geometry/body.h"
#include "nn/models/views.h"

namespace restage {

class OwnBody {
 public:
  /// Every point hangs on the bones near it, each with a weight that falls with its distance. Where
  /// `seen` gives no rotations, they are the closed form's from the first frame that is added.
  void add(const Points& cloud, const SeenJoints& seen);
  bool empty() const { return points_.empty(); }
  /// Mean distance of the cloud's points from the body in that frame's pose, metres. The body must
  /// not be empty, and the cloud neither.
  double distance(const Points& cloud, const SeenJoints& seen) const;

 private:
  static constexpr size_t kBones = 3;
  struct Point {
    std::array<size_t, kBones> joint;
    std::array<double, kBones> weight;  ///< the sum is 1
    std::array<Vec3, kBones> place;     ///< in the axes of each joint, from it
  };
  Rotations turns(const SeenJoints& seen) const;

  std::optional<Joints> first_;
  std::vector<Point> points_;
};

}  // namespace restage
