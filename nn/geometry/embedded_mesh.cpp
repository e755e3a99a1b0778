#include "nn/geometry/embedded_mesh.h"

#include <Eigen/SVD>
#include <algorithm>
#include <limits>
#include <utility>

#include "autograd/base/error.h"
#include "autograd/base/parallel.h"

namespace restage {
namespace {

/// The `count` nearest of the nodes to `at`, nearest first, with their distances.
std::vector<std::pair<float, int32_t>> nearest_nodes(const Points& nodes, const Point& at,
                                                     size_t count) {
  std::vector<std::pair<float, int32_t>> all(nodes.size());
  for (size_t k = 0; k < nodes.size(); ++k)
    all[k] = {(nodes[k] - at).norm(), static_cast<int32_t>(k)};
  count = std::min(count, all.size());
  std::partial_sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count), all.end());
  all.resize(count);
  return all;
}

/// The rotation that turns `sum`, the products of moved and rest differences, into a symmetric
/// matrix.
Mat3 rotation_of(const Mat3& sum) {
  const Eigen::JacobiSVD<Mat3> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double hand = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  return svd.matrixU() * Vec3(1, 1, hand).asDiagonal() * svd.matrixV().transpose();
}

}  // namespace

std::vector<int32_t> evenly_spread(const Points& points, size_t count) {
  std::vector<float> nearest(points.size(), std::numeric_limits<float>::max());
  std::vector<int32_t> out;
  size_t next = 0;
  while (out.size() < count) {
    out.push_back(static_cast<int32_t>(next));
    const Point at = points[next];
    for (size_t i = 0; i < points.size(); ++i)
      nearest[i] = std::min(nearest[i], (points[i] - at).squaredNorm());
    next = static_cast<size_t>(std::max_element(nearest.begin(), nearest.end()) - nearest.begin());
    if (nearest[next] == 0) break;  // all others coincide with one that is kept
  }
  std::sort(out.begin(), out.end());
  return out;
}

EmbeddedMesh::EmbeddedMesh(const Points& whole, std::vector<int32_t> nodes)
    : nodes_(std::move(nodes)), rest_(whole) {
  Points at;
  for (const int32_t i : nodes_) {
    if (i < 0 || i >= std::ssize(whole))
      throw ShapeError("EmbeddedMesh: there is no vertex " + std::to_string(i));
    at.push_back(whole[static_cast<size_t>(i)]);
  }
  if (nodes_.size() == whole.size()) return;  // nothing follows
  if (nodes_.size() < kFewest) throw ShapeError("EmbeddedMesh: needs five nodes");
  near_.resize(nodes_.size());
  followers_.resize(whole.size());
  parallel_for(std::ssize(nodes_), 16, [&](int64_t from, int64_t to) {
    for (auto k = static_cast<size_t>(from); k < static_cast<size_t>(to); ++k) {
      near_[k].fill(static_cast<int32_t>(k));
      const auto found = nearest_nodes(at, at[k], kNear + 1);
      for (size_t m = 1; m < found.size(); ++m) near_[k][m - 1] = found[m].second;
    }
  });
  parallel_for(std::ssize(whole), 64, [&](int64_t from, int64_t to) {
    for (auto i = static_cast<size_t>(from); i < static_cast<size_t>(to); ++i) {
      const auto found = nearest_nodes(at, whole[i], kFollow + 1);
      const float reach = std::max(found.back().first, 1e-9f);
      Follower& f = followers_[i];
      float total = 0;
      for (size_t m = 0; m < kFollow; ++m) {
        const float share = found[0].first == 0 ? (m == 0 ? 1.f : 0.f) : 1 - found[m].first / reach;
        f.node[m] = found[m].second;
        f.weight[m] = share * share;
        total += f.weight[m];
      }
      if (total == 0) f.weight[0] = total = 1;  // all as near as the fifth
      for (float& w : f.weight) w /= total;
    }
  });
}

Points EmbeddedMesh::operator()(const Points& moved) const {
  if (moved.size() != nodes_.size())
    throw ShapeError("EmbeddedMesh: has " + std::to_string(nodes_.size()) + " nodes, was given " +
                     std::to_string(moved.size()));
  if (nodes_.size() == rest_.size()) {
    Points out(rest_.size());
    for (size_t k = 0; k < nodes_.size(); ++k) out[static_cast<size_t>(nodes_[k])] = moved[k];
    return out;
  }
  const auto rest_of = [&](size_t k) -> const Point& {
    return rest_[static_cast<size_t>(nodes_[k])];
  };
  std::vector<Eigen::Matrix3f> turned(nodes_.size());
  parallel_for(std::ssize(nodes_), 64, [&](int64_t from, int64_t to) {
    for (auto k = static_cast<size_t>(from); k < static_cast<size_t>(to); ++k) {
      Mat3 sum = Mat3::Zero();
      for (const int32_t other : near_[k]) {
        const auto o = static_cast<size_t>(other);
        sum += (moved[o] - moved[k]).cast<double>() *
               (rest_of(o) - rest_of(k)).cast<double>().transpose();
      }
      turned[k] = rotation_of(sum).cast<float>();
    }
  });
  Points out(rest_.size());
  parallel_for(std::ssize(out), 1024, [&](int64_t from, int64_t to) {
    for (auto i = static_cast<size_t>(from); i < static_cast<size_t>(to); ++i) {
      Point p = Point::Zero();
      for (size_t m = 0; m < kFollow; ++m) {
        const auto k = static_cast<size_t>(followers_[i].node[m]);
        p += followers_[i].weight[m] * (moved[k] + turned[k] * (rest_[i] - rest_of(k)));
      }
      out[i] = p;
    }
  });
  return out;
}

}  // namespace restage
