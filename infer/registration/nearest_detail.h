// The nearest of a set of points, by a k-d tree.
#pragma once

#include <limits>
#include <nanoflann.hpp>
#include <vector>

#include "nn/geometry/skeleton.h"

namespace restage {

class NearestPoint {
 public:
  /// `points` must outlive the object and hold at least one point.
  explicit NearestPoint(const std::vector<Vec3>& points) : cloud_{points} {}
  NearestPoint(const NearestPoint&) = delete;
  NearestPoint& operator=(const NearestPoint&) = delete;

  struct Found {
    size_t index;
    double squared;  ///< distance
  };
  Found operator()(const Vec3& p) const {
    uint32_t index = 0;
    double squared = std::numeric_limits<double>::infinity();
    tree_.knnSearch(p.data(), 1, &index, &squared);
    return {index, squared};
  }

 private:
  struct Cloud {
    const std::vector<Vec3>& points;
    size_t kdtree_get_point_count() const { return points.size(); }
    double kdtree_get_pt(size_t i, size_t axis) const { return points[i][static_cast<int>(axis)]; }
    template <class Box>
    bool kdtree_get_bbox(Box&) const {
      return false;
    }
  };
  Cloud cloud_;
  nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Cloud>, Cloud, 3,
                                      uint32_t>
      tree_{3, cloud_, nanoflann::KDTreeSingleIndexAdaptorParams(10)};
};

}  // namespace restage
