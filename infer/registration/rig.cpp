#include "infer/registration/rig.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "autograd/base/error.h"
#include "nn/geometry/normals.h"

namespace restage {
namespace {

struct Segment {
  int joint;
  Vec3 from, to;
};

std::vector<Segment> bones_of(const Joints& rest) {
  std::vector<Segment> out;
  std::array<bool, kJoints> has_child{};
  for (int j = 1; j < kJoints; ++j) {
    has_child[kParents[j]] = true;
    out.push_back({kParents[j], rest[kParents[j]], rest[j]});
  }
  for (int j = 1; j < kJoints; ++j)
    if (!has_child[j]) out.push_back({j, rest[j], 2 * rest[j] - rest[kParents[j]]});
  return out;
}

double distance(const Vec3& p, const Segment& s) {
  const Vec3 along = s.to - s.from;
  const double squared = along.squaredNorm();
  const double t = squared > 0 ? std::clamp((p - s.from).dot(along) / squared, 0.0, 1.0) : 0.0;
  return (s.from + t * along - p).norm();
}

/// Indices of `count` points that are far from each other, by farthest point sampling; the first is
/// the point farthest from the middle of all.
std::vector<size_t> spread(const Points& points, size_t count) {
  Vec3 middle = Vec3::Zero();
  for (const Point& p : points) middle += p.cast<double>() / static_cast<double>(points.size());
  std::vector<float> nearest(points.size());
  for (size_t i = 0; i < points.size(); ++i)
    nearest[i] = (points[i] - middle.cast<float>()).squaredNorm();
  std::vector<size_t> out;
  while (out.size() < count && !points.empty()) {
    const auto far = std::max_element(nearest.begin(), nearest.end());
    if (!(*far > 0)) break;  // the points that are left are copies of chosen ones
    const auto chosen = static_cast<size_t>(far - nearest.begin());
    const bool first = out.empty();
    out.push_back(chosen);
    for (size_t i = 0; i < points.size(); ++i) {
      const float d = (points[i] - points[chosen]).squaredNorm();
      nearest[i] = first ? d : std::min(nearest[i], d);
    }
  }
  return out;
}

void connect(std::vector<RigNode>& nodes) {
  std::vector<int> order(nodes.size());
  for (size_t i = 0; i < nodes.size(); ++i) {
    std::iota(order.begin(), order.end(), 0);
    const auto squared = [&](int k) { return (nodes[k].rest - nodes[i].rest).squaredNorm(); };
    const size_t wanted = nodes[i].neighbours.size() + 1;  // the nearest node is node i itself
    std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(wanted),
                      order.end(), [&](int a, int b) {
                        const double x = squared(a), y = squared(b);
                        return x < y || (x == y && a < b);
                      });
    std::copy_n(order.begin() + 1, wanted - 1, nodes[i].neighbours.begin());
  }
}

void check(const Mesh& target, const Joints& rest, const std::string& where) {
  for (const Point& p : target.vertices)
    if (!p.allFinite())
      throw InputError(where, "holds a coordinate that is not finite", "remove such points");
  for (const Vec3& p : rest)
    if (!p.allFinite())
      throw InputError(where, "has a joint that is not finite", "give all 22 rest joints");
}

}  // namespace

SkinWeights bone_distance_weights(const Points& points, const Joints& rest) {
  constexpr double kTouching = 0.005;  // metres; smaller distances are taken for this one
  const std::vector<Segment> bones = bones_of(rest);
  SkinWeights out = SkinWeights::Zero(static_cast<Eigen::Index>(points.size()), kJoints);
  for (size_t v = 0; v < points.size(); ++v) {
    std::array<double, kJoints> near;
    near.fill(std::numeric_limits<double>::infinity());
    for (const Segment& bone : bones) {
      double& best = near[bone.joint];
      best = std::min(best, distance(points[v].cast<double>(), bone));
    }
    std::array<int, kJoints> order;
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return near[a] < near[b]; });
    auto row = out.row(static_cast<Eigen::Index>(v));
    for (int k = 0; k < 4; ++k)
      row[order[k]] = static_cast<float>(std::pow(std::max(kTouching, near[order[k]]), -4));
    row /= row.sum();
  }
  return out;
}

Rig make_rig(const Mesh& target, const Joints& rest, const std::string& where, size_t count) {
  check(target, rest, where);
  const std::vector<size_t> chosen = spread(target.vertices, count);
  if (chosen.size() < kLeastRigPoints)
    throw InputError(
        where, "holds " + std::to_string(chosen.size()) + " distinct points, too few for a body",
        "give at least " + std::to_string(kLeastRigPoints));
  const auto normals = vertex_normals<Vec3>(target.vertices, target.faces, Vec3::Zero());
  Points places;
  for (const size_t v : chosen) places.push_back(target.vertices[v]);
  const SkinWeights weights = bone_distance_weights(places, rest);
  Rig rig;
  rig.joints = rest;
  for (size_t i = 0; i < chosen.size(); ++i) {
    RigNode& node = rig.nodes.emplace_back();
    node.rest = places[i].cast<double>();
    node.normal = normals[chosen[i]];
    Eigen::Matrix<double, 1, kJoints> row =
        weights.row(static_cast<Eigen::Index>(i)).cast<double>();
    for (size_t k = 0; k < node.joint.size(); ++k) {
      node.weight[k] = row.maxCoeff(&node.joint[k]);
      row[node.joint[k]] = -1;
      node.weight[k] = std::max(0.0, node.weight[k]);
    }
    const double sum = node.weight[0] + node.weight[1] + node.weight[2] + node.weight[3];
    for (double& w : node.weight) w /= sum;
  }
  connect(rig.nodes);
  return rig;
}

}  // namespace restage
