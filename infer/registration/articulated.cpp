#include "infer/registration/articulated.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "infer/registration/nearest_detail.h"

namespace restage {
namespace {

// The unknowns of one step: the place, the logarithm of the size, a rotation vector for each joint
// (in its parent's frame), the stretch of each bone (left and right share one unknown, that of the
// joint with the lower number).
constexpr int kPlace = 0, kSize = 3, kTurn = 4, kStretch = kTurn + 3 * kJoints,
              kUnknowns = kStretch + kJoints;
using Normal = Eigen::Matrix<double, kUnknowns, kUnknowns>;
using Step = Eigen::Matrix<double, kUnknowns, 1>;

int pair_of(int joint) { return std::min(joint, kMirror[joint]); }

Mat3 cross_matrix(const Vec3& v) {
  Mat3 m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Vec3 rotation_vector(const Mat3& r) {
  const Eigen::AngleAxisd a(r);
  return a.angle() * a.axis();
}

Mat3 rotation_by(const Vec3& v) {
  const double angle = v.norm();
  return angle > 0 ? Eigen::AngleAxisd(angle, v / angle).toRotationMatrix() : Mat3::Identity();
}

// ---- what is known of people before a cloud is seen --------------------------------------------

/// Cost of a squared radian about each axis of a joint's rotation vector, added to the mean squared
/// distance (square metres). Trunk, collars, hands, feet and head are stiff; limbs are nearly free;
/// knees and elbows are hinges.
Vec3 stiffness(int joint) {
  switch (joint) {
    case 0:
      return Vec3::Zero();
    case 1:
    case 2:
    case 16:
    case 17:
      return Vec3::Constant(2e-5);
    case 4:
    case 5:
      return {2e-5, 3e-3, 3e-3};  // a knee bends about x
    case 18:
    case 19:
      return {3e-3, 2e-5, 1e-3};  // an elbow bends about y; a turn about x is the forearm's twist
    case 3:
    case 6:
    case 9:
    case 12:
    case 13:
    case 14:
      return Vec3::Constant(1e-3);
    default:
      return Vec3::Constant(3e-3);  // feet, toes, hands, head
  }
}
/// Knees and elbows bend one way only: about which axis, with which sign, and the cost of bending
/// the other way.
struct Hinge {
  int joint, axis;
  double sign;
};
constexpr Hinge kHinges[] = {{4, 0, 1}, {5, 0, 1}, {18, 1, -1}, {19, 1, 1}};
constexpr double kOtherWay = 1e-2;
constexpr double kDamping = 1e-5;

// ---- matches -----------------------------------------------------------------------------------

/// Sums over all matches of one node, which lies at y, with points p: the sum of weight M, and the
/// sum of weight M (y - p). The matrix M counts the part of the distance along the node's normal in
/// full and the part across the normal less.
struct Pull {
  Mat3 weight = Mat3::Zero();
  Vec3 residual = Vec3::Zero();
  void add(const Vec3& y, const Vec3& normal, const Vec3& p, double w) {
    constexpr double kAcross = 0.3;
    Mat3 m = Mat3::Identity();
    if (!normal.isZero())
      m = kAcross * Mat3::Identity() + (1 - kAcross) * (normal * normal.transpose());
    weight += w * m;
    residual += w * (m * (y - p));
  }
};

std::vector<Pull> matches(const PosedRig& posed, const std::vector<Vec3>& cloud,
                          const NearestPoint& in_cloud, double width) {
  std::vector<Pull> out(posed.nodes.size());
  for_matches(posed.nodes, cloud, in_cloud, width, [&](size_t i, const Vec3& p, double w) {
    out[i].add(posed.nodes[i], posed.normals[i], p, w);
  });
  return out;
}

// ---- one step ----------------------------------------------------------------------------------

struct Equations {
  Normal h = Normal::Zero();
  Step g = Step::Zero();
  void prior(int unknown, double weight, double value) {
    h(unknown, unknown) += weight;
    g[unknown] += weight * value;
  }
};

/// The derivative of one node's place by the unknowns that move the node.
class NodeDerivative {
 public:
  NodeDerivative(const Rig& rig, const RigState& state, const PosedRig& posed)
      : rig_(rig), state_(state), posed_(posed) {}

  void add(size_t i, const Pull& pull, Equations& e) {
    gather(i);
    columns_.clear();
    jacobian_.resize(3, kUnknowns);
    for (int c = 0; c < 3; ++c) column(kPlace + c, Vec3::Unit(c));
    column(kSize, posed_.nodes[i] - posed_.skeleton.joints[0]);
    for (int k = 0; k < kJoints; ++k) {
      const double w = share_[k];
      if (!(w > 0)) continue;
      const Mat3 frame = k == 0 ? Mat3::Identity() : posed_.skeleton.global[parent(k)];
      const Vec3 arm = moment_[k] - w * posed_.skeleton.joints[k];
      const Mat3 turn = -cross_matrix(arm) * frame;
      for (int c = 0; c < 3; ++c) column(kTurn + 3 * k + c, turn.col(c));
      if (k > 0) column(kStretch + pair_of(k), w * state_.scale * (frame * bone(k)));
    }
    const auto n = static_cast<Eigen::Index>(columns_.size());
    const Eigen::Matrix<double, 3, Eigen::Dynamic> j = jacobian_.leftCols(n);
    const Eigen::MatrixXd h = j.transpose() * pull.weight * j;
    const Eigen::VectorXd g = j.transpose() * pull.residual;
    for (Eigen::Index a = 0; a < n; ++a) {
      e.g[columns_[a]] += g[a];
      for (Eigen::Index b = 0; b < n; ++b) e.h(columns_[a], columns_[b]) += h(a, b);
    }
  }

 private:
  static size_t parent(int k) { return static_cast<size_t>(kParents[k]); }
  Vec3 bone(int k) const { return rig_.joints[k] - rig_.joints[parent(k)]; }

  /// For each joint: the share of the node that this joint and the joints below it carry, and the
  /// place to which they carry the node.
  void gather(size_t i) {
    share_.fill(0);
    moment_.fill(Vec3::Zero());
    const RigNode& node = rig_.nodes[i];
    for (size_t m = 0; m < node.joint.size(); ++m) {
      const auto j = static_cast<size_t>(node.joint[m]);
      const Vec3 carried =
          posed_.skeleton.joints[j] +
          state_.scale * (posed_.skeleton.global[j] * (node.rest - rig_.joints[j]));
      for (int k = node.joint[m]; k >= 0; k = kParents[k]) {
        share_[k] += node.weight[m];
        moment_[k] += node.weight[m] * carried;
      }
    }
  }

  void column(int unknown, const Vec3& value) {
    jacobian_.col(static_cast<Eigen::Index>(columns_.size())) = value;
    columns_.push_back(unknown);
  }

  const Rig& rig_;
  const RigState& state_;
  const PosedRig& posed_;
  std::array<double, kJoints> share_;
  std::array<Vec3, kJoints> moment_;
  std::vector<int> columns_;
  Eigen::Matrix<double, 3, Eigen::Dynamic> jacobian_;
};

void add_priors(const RigState& state, const ArticulatedOptions& options, Equations& e) {
  for (int k = 0; k < kJoints; ++k) {
    const Vec3 weight = stiffness(k), angle = rotation_vector(state.pose.local[k]);
    for (int c = 0; c < 3; ++c) e.prior(kTurn + 3 * k + c, options.turns * weight[c], angle[c]);
  }
  for (const Hinge& hinge : kHinges) {
    const double angle = rotation_vector(state.pose.local[hinge.joint])[hinge.axis];
    if (angle * hinge.sign < 0) e.prior(kTurn + 3 * hinge.joint + hinge.axis, kOtherWay, angle);
  }
  e.prior(kSize, options.size, std::log(state.scale));
  for (int k = 0; k < kJoints; ++k) e.prior(kStretch + k, options.stretch, state.stretch[k] - 1);
  e.h.diagonal().array() += kDamping;
}

void take(const Step& step, RigState& state) {
  state.pose.root += step.segment<3>(kPlace);
  state.scale = std::clamp(state.scale * std::exp(step[kSize]), 0.3, 3.0);
  for (int k = 0; k < kJoints; ++k) {
    auto& local = state.pose.local[k];
    local = rotation_by(step.segment<3>(kTurn + 3 * k)) * local;
    double& stretch = state.stretch[k];
    stretch = std::clamp(stretch + step[kStretch + pair_of(k)], 0.5, 2.0);
  }
}

}  // namespace

Joints built(const Joints& rest, const RigState& state) {
  Joints out;
  out[0] = rest[0];
  for (size_t j = 1; j < out.size(); ++j) {
    const auto p = static_cast<size_t>(kParents[j]);
    out[j] = out[p] + state.scale * state.stretch[j] * (rest[j] - rest[p]);
  }
  return out;
}

PosedRig pose_rig(const Rig& rig, const RigState& state) {
  PosedRig out;
  out.skeleton = forward_kinematics(built(rig.joints, state), state.pose);
  for (const RigNode& node : rig.nodes) {
    Vec3 place = Vec3::Zero(), normal = Vec3::Zero();
    for (size_t m = 0; m < node.joint.size(); ++m) {
      const auto j = static_cast<size_t>(node.joint[m]);
      const Mat3& turn = out.skeleton.global[j];
      place += node.weight[m] *
               (out.skeleton.joints[j] + state.scale * (turn * (node.rest - rig.joints[j])));
      normal += node.weight[m] * (turn * node.normal);
    }
    out.nodes.push_back(place);
    out.normals.push_back(normal.norm() > 0 ? normal.normalized() : normal);
  }
  return out;
}

double misfit(const PosedRig& posed, const std::vector<Vec3>& cloud, double width) {
  const auto cost = [&](double squared) {
    return width * width * squared / (width * width + squared);
  };
  double nodes = 0, points = 0;
  const NearestPoint in_cloud(cloud), in_rig(posed.nodes);
  for (const Vec3& y : posed.nodes) nodes += cost(in_cloud(y).squared);
  for (const Vec3& p : cloud) points += cost(in_rig(p).squared);
  return nodes / static_cast<double>(posed.nodes.size()) +
         points / static_cast<double>(cloud.size());
}

RigState fit_articulated(const Rig& rig, const std::vector<Vec3>& cloud, RigState state,
                         const ArticulatedOptions& options) {
  const NearestPoint in_cloud(cloud);
  for (int n = 0; n < options.iterations; ++n) {
    const double t = options.iterations > 1 ? static_cast<double>(n) / (options.iterations - 1) : 1;
    const double width = options.widest * std::pow(options.narrowest / options.widest, t);
    const PosedRig posed = pose_rig(rig, state);
    const std::vector<Pull> pulls = matches(posed, cloud, in_cloud, width);
    Equations e;
    NodeDerivative derivative(rig, state, posed);
    for (size_t i = 0; i < rig.nodes.size(); ++i) derivative.add(i, pulls[i], e);
    add_priors(state, options, e);
    const Step step = -e.h.ldlt().solve(e.g);
    if (!step.allFinite()) break;  // the state so far is the answer
    // The derivative holds for small turns only: no joint turns by more than half a radian in a
    // step.
    const double most = step.segment<3 * kJoints>(kTurn).cwiseAbs().maxCoeff();
    take(step * std::min(1.0, 0.5 / std::max(most, 1e-12)), state);
  }
  return state;
}

}  // namespace restage
