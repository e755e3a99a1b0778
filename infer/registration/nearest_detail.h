// Finds the nearest of a set of points by a k-d tree, and matches two sets of points.
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
    double squared;  ///< the squared distance
  };
  Found operator()(const Vec3& p) const {
    uint32_t index = 0;
    double squared = std::numeric_limits<double>::infinity();
    tree_.knnSearch(p.data(), 1, &index, &squared);
    return {index, squared};
  }
  /// The `count` nearest ones, the nearest first; all of them if there are fewer.
  std::vector<uint32_t> nearest(const Vec3& p, size_t count) const {
    std::vector<uint32_t> found(count);
    std::vector<double> squared(count);
    found.resize(tree_.knnSearch(p.data(), count, found.data(), squared.data()));
    return found;
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

/// Calls visit(index of a node, point, weight) for every node with its nearest point, and for every
/// point with its nearest node. Weights are Geman and McClure's of the squared distance. If all
/// distances are zero, the weights from nodes to points sum to one, and so do those from points to
/// nodes.
template <class F>
void for_matches(const std::vector<Vec3>& nodes, const std::vector<Vec3>& cloud,
                 const NearestPoint& in_cloud, double width, F&& visit) {
  const auto kernel = [&](double squared) {
    const double w = width * width / (width * width + squared);
    return w * w;
  };
  const double per_node = 1.0 / static_cast<double>(nodes.size());
  for (size_t i = 0; i < nodes.size(); ++i) {
    const auto [k, squared] = in_cloud(nodes[i]);
    visit(i, cloud[k], per_node * kernel(squared));
  }
  const NearestPoint in_nodes(nodes);
  const double per_point = 1.0 / static_cast<double>(cloud.size());
  for (const Vec3& p : cloud) {
    const auto [i, squared] = in_nodes(p);
    visit(i, p, per_point * kernel(squared));
  }
}

}  // namespace restage
