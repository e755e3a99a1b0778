#include "infer/registration/free_form.h"

#include <Eigen/SVD>
#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>

#include "infer/registration/nearest_detail.h"

namespace restage {
namespace {

using Matrix = Eigen::SparseMatrix<double>;
using Triplets = std::vector<Eigen::Triplet<double>>;

// Each node has a displacement d and a matrix A: a point x near the node is displaced by
// d + A (x - node). These are four rows of unknowns (A's columns, then d), times three coordinates.

/// Two costs for every pair of neighbours: of the difference between the displacements that both
/// give to the point halfway between them, and of the difference between their matrices.
void add_stiffness(const Rig& rig, const std::vector<Vec3>& nodes, double alpha, Triplets& out) {
  constexpr double kReach = 0.05;  // metres over which a difference of matrices counts
  const double weight = alpha / static_cast<double>(8 * nodes.size());
  for (size_t i = 0; i < nodes.size(); ++i)
    for (const int other : rig.nodes[i].neighbours) {
      const Vec3 half = 0.5 * (nodes[other] - nodes[i]);
      Eigen::Matrix<double, 8, 1> row;
      row << half, 1, half, -1;
      const auto at = [&](int r) {
        return r < 4 ? 4 * static_cast<int>(i) + r : 4 * other + r - 4;
      };
      for (int r = 0; r < 8; ++r)
        for (int c = 0; c < 8; ++c) out.emplace_back(at(r), at(c), weight * row[r] * row[c]);
      for (int r = 0; r < 3; ++r) {
        const double w = weight * kReach * kReach;
        out.emplace_back(at(r), at(r), w);
        out.emplace_back(at(r + 4), at(r + 4), w);
        out.emplace_back(at(r), at(r + 4), -w);
        out.emplace_back(at(r + 4), at(r), -w);
      }
    }
}

/// For every node: the sum of the weights of its matches, and the weighted sum of the matched
/// points.
struct Targets {
  std::vector<double> weight;
  std::vector<Vec3> sum;
};

Targets matches(const std::vector<Vec3>& nodes, const std::vector<Vec3>& cloud,
                const NearestPoint& in_cloud, double width) {
  Targets out{std::vector<double>(nodes.size(), 0), std::vector<Vec3>(nodes.size(), Vec3::Zero())};
  for_matches(nodes, cloud, in_cloud, width, [&](size_t i, const Vec3& p, double w) {
    out.weight[i] += w;
    out.sum[i] += w * p;
  });
  return out;
}

}  // namespace

std::vector<Vec3> fit_free_form(const Rig& rig, const PosedRig& posed,
                                const std::vector<Vec3>& cloud, const FreeFormOptions& options) {
  const auto n = static_cast<Eigen::Index>(rig.nodes.size());
  const NearestPoint in_cloud(cloud);
  std::vector<Vec3> moved = posed.nodes;
  Eigen::SimplicialLDLT<Matrix> solver;
  for (const double alpha : options.stiffness) {
    Triplets stiff;
    add_stiffness(rig, posed.nodes, alpha, stiff);
    for (Eigen::Index r = 0; r < 4 * n; ++r) stiff.emplace_back(r, r, 1e-12);
    for (int step = 0; step < options.steps; ++step) {
      const Targets targets = matches(moved, cloud, in_cloud, options.width);
      Triplets entries = stiff;
      Eigen::MatrixXd right = Eigen::MatrixXd::Zero(4 * n, 3);
      for (Eigen::Index i = 0; i < n; ++i) {
        const auto k = static_cast<size_t>(i);
        entries.emplace_back(4 * i + 3, 4 * i + 3, targets.weight[k]);
        right.row(4 * i + 3) = (targets.sum[k] - targets.weight[k] * posed.nodes[k]).transpose();
      }
      Matrix system(4 * n, 4 * n);
      system.setFromTriplets(entries.begin(), entries.end());
      solver.compute(system);
      if (solver.info() != Eigen::Success) return moved;
      const Eigen::MatrixXd maps = solver.solve(right);
      if (!maps.allFinite()) return moved;
      for (Eigen::Index i = 0; i < n; ++i)
        moved[i] = posed.nodes[i] + maps.row(4 * i + 3).transpose();
    }
  }
  return moved;
}

Pose refit_pose(const Rig& rig, const PosedRig& posed, const std::vector<Vec3>& moved) {
  Rotations global = posed.skeleton.global;
  Pose pose;
  pose.root = posed.skeleton.joints[0];
  std::array<Mat3, kJoints> turned;
  for (size_t j = 0; j < global.size(); ++j) {
    turned[j] = j == 0 ? Mat3::Identity() : turned[kParents[j]];
    double total = 0;
    Vec3 before = Vec3::Zero(), after = Vec3::Zero();
    const auto each = [&](const auto& visit) {
      for (size_t i = 0; i < rig.nodes.size(); ++i)
        for (size_t m = 0; m < rig.nodes[i].joint.size(); ++m)
          if (static_cast<size_t>(rig.nodes[i].joint[m]) == j) visit(i, rig.nodes[i].weight[m]);
    };
    each([&](size_t i, double w) {
      total += w;
      before += w * posed.nodes[i];
      after += w * moved[i];
    });
    if (!(total > 3)) continue;  // too few nodes to tell: the joint turns as its parent does
    before /= total;
    after /= total;
    Mat3 sum = Mat3::Zero();
    each([&](size_t i, double w) {
      sum += w * (moved[i] - after) * (posed.nodes[i] - before).transpose();
    });
    const Eigen::JacobiSVD<Mat3> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const double hand = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
    turned[j] = svd.matrixU() * Vec3(1, 1, hand).asDiagonal() * svd.matrixV().transpose();
    if (j == 0) pose.root = after + turned[0] * (posed.skeleton.joints[0] - before);
  }
  for (size_t j = 0; j < global.size(); ++j) global[j] = turned[j] * global[j];
  pose.local = to_local(global);
  return pose;
}

}  // namespace restage
