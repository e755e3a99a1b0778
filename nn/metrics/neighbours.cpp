// Nearest neighbours for edge lengths: a k-d tree (nanoflann) made independent of the order in
// which it visits its leaves.
#include <array>
#include <cmath>
#include <limits>
#include <nanoflann.hpp>

#include "nn/metrics/metrics.h"

namespace restage::metrics {
namespace {

struct Cloud {
  const double* points;
  size_t count;
  size_t kdtree_get_point_count() const { return count; }
  double kdtree_get_pt(size_t i, size_t axis) const { return points[3 * i + axis]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

/// The nearest points other than `self`, ordered by distance, then by index. The tree skips points
/// that are not nearer than worstDist(), so one step beyond the worst lets ties through.
class Nearest {
 public:
  using DistanceType = double;

  explicit Nearest(uint32_t self) : self_(self) {
    distance_.fill(std::numeric_limits<double>::max());
    index_.fill(std::numeric_limits<uint32_t>::max());
  }
  bool full() const { return true; }
  double worstDist() const {
    return std::nextafter(distance_.back(), std::numeric_limits<double>::infinity());
  }
  bool addPoint(double distance, uint32_t index) {
    if (index == self_) return true;
    int at = kEdgeNeighbours;
    while (at > 0 && comes_before(distance, index, static_cast<size_t>(at - 1))) --at;
    if (at == kEdgeNeighbours) return true;
    for (auto i = static_cast<size_t>(kEdgeNeighbours - 1); i > static_cast<size_t>(at); --i) {
      distance_[i] = distance_[i - 1];
      index_[i] = index_[i - 1];
    }
    distance_[at] = distance;
    index_[at] = index;
    return true;
  }
  const std::array<uint32_t, kEdgeNeighbours>& indices() const { return index_; }

 private:
  bool comes_before(double distance, uint32_t index, size_t i) const {
    return distance < distance_[i] || (distance == distance_[i] && index < index_[i]);
  }

  uint32_t self_;
  std::array<double, kEdgeNeighbours> distance_;
  std::array<uint32_t, kEdgeNeighbours> index_;
};

}  // namespace

std::vector<int32_t> nearest_neighbours(const double* points, int64_t count) {
  using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Cloud>,
                                                   Cloud, 3, uint32_t>;
  const Cloud cloud{points, static_cast<size_t>(count)};
  Tree tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(10));
  std::vector<int32_t> out;
  out.reserve(static_cast<size_t>(count) * kEdgeNeighbours);
  for (int64_t i = 0; i < count; ++i) {
    Nearest nearest(static_cast<uint32_t>(i));
    tree.findNeighbors(nearest, points + 3 * i, nanoflann::SearchParams());
    // A slot stays empty only if squared distances overflow; any other point then serves.
    for (const uint32_t j : nearest.indices())
      out.push_back(j < static_cast<uint32_t>(count) ? static_cast<int32_t>(j) : 0);
  }
  return out;
}

}  // namespace restage::metrics
