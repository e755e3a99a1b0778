#include "infer/track/pose_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "nn/geometry/normals.h"

namespace restage {
namespace {

constexpr int kPoseUnknowns = 3 + 3 * kJoints;  // the place, a turn for each joint
using PoseNormal = Eigen::Matrix<double, kPoseUnknowns, kPoseUnknowns>;
using PoseStep = Eigen::Matrix<double, kPoseUnknowns, 1>;

constexpr double kAlongSurface = 0.05;  // how much a distance along the surface counts
constexpr double kPoseDamping = 1e-6;

/// Cost of a squared radian away from the start, beside the mean squared distance (square metres).
double turn_cost(int joint) {
  switch (joint) {
    case kPelvis:
      return 1e-6;
    case kLeftHip:
    case kRightHip:
    case kLeftKnee:
    case kRightKnee:
    case kLeftShoulder:
    case kRightShoulder:
    case kLeftElbow:
    case kRightElbow:
      return 2e-5;
    case kLeftAnkle:
    case kRightAnkle:
    case kHead:
      return 5e-5;
    case kLeftWrist:
    case kRightWrist:
      return 1e-4;
    default:
      return 2e-4;  // trunk, collars, toes
  }
}

/// The equations of one step.
class PoseEquations {
 public:
  PoseEquations(const Body& body, const PosedSkeleton& posed) : body_(body), posed_(posed) {}

  void add(const SurfaceMatch& match, const Vec3& at, const Vec3& normal, double weight) {
    derive(match.vertex);
    const Vec3 away = at - match.point;
    const auto j = jacobian_.leftCols(used_);
    const Eigen::Matrix<double, 1, Eigen::Dynamic> along = normal.transpose() * j;
    const double across = 1 - kAlongSurface;
    const Eigen::MatrixXd h =
        weight * (kAlongSurface * j.transpose() * j + across * along.transpose() * along);
    const Eigen::VectorXd g = weight * (kAlongSurface * j.transpose() * away +
                                        across * along.transpose() * normal.dot(away));
    for (int a = 0; a < used_; ++a) {
      gradient_[columns_[a]] += g[a];
      for (int b = 0; b < used_; ++b) normal_(columns_[a], columns_[b]) += h(a, b);
    }
  }

  void hold(const Pose& now, const Pose& start, double stiffness) {
    for (int k = 0; k < kJoints; ++k) {
      const Vec3 away = turn_vector(now.local[k] * start.local[k].transpose());
      const double cost = stiffness * turn_cost(k);
      for (int c = 0; c < 3; ++c) {
        normal_(3 + 3 * k + c, 3 + 3 * k + c) += cost;
        gradient_[3 + 3 * k + c] += cost * away[c];
      }
    }
  }

  PoseStep solve() {
    normal_.diagonal().array() += kPoseDamping;
    return normal_.ldlt().solve(-gradient_);
  }

 private:
  /// How a vertex moves: turning joint k moves what hangs on it about its place.
  void derive(size_t vertex) {
    std::array<Vec3, kJoints> moment;
    std::array<double, kJoints> share{};
    moment.fill(Vec3::Zero());
    const Vec3 rest = body_.rest.vertices[vertex].cast<double>();
    for (int j = kJoints - 1; j >= 0; --j) {
      const double w = body_.weights(static_cast<Eigen::Index>(vertex), j);
      if (w > 0) {
        share[j] += w;
        moment[j] += w * (posed_.global[j] * (rest - body_.joints[j]) + posed_.joints[j]);
      }
      if (j > 0) share[kParents[j]] += share[j], moment[kParents[j]] += moment[j];
    }
    used_ = 0;
    const auto column = [&](int unknown, const Vec3& by) {
      columns_[used_] = unknown;
      jacobian_.col(used_++) = by;
    };
    for (int c = 0; c < 3; ++c) column(c, Vec3::Unit(c));
    for (int k = 0; k < kJoints; ++k) {
      if (!(share[k] > 0)) continue;
      const Mat3 frame = k == 0 ? Mat3(Mat3::Identity()) : posed_.global[kParents[k]];
      const Mat3 turn = -cross_with(moment[k] - share[k] * posed_.joints[k]) * frame;
      for (int c = 0; c < 3; ++c) column(3 + 3 * k + c, turn.col(c));
    }
  }

  const Body& body_;
  const PosedSkeleton& posed_;
  PoseNormal normal_ = PoseNormal::Zero();
  PoseStep gradient_ = PoseStep::Zero();
  Eigen::Matrix<double, 3, kPoseUnknowns> jacobian_;
  std::array<int, kPoseUnknowns> columns_;
  int used_ = 0;
};

}  // namespace

Vec3 turn_vector(const Mat3& turn) {
  const Eigen::AngleAxisd a(turn);
  return a.angle() * a.axis();
}

Mat3 turn_of(const Vec3& vector) {
  const double angle = vector.norm();
  return angle > 0 ? Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix() : Mat3::Identity();
}

Mat3 cross_with(const Vec3& v) {
  Mat3 m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

std::vector<Vec3> skinned(const Body& body, const Pose& pose) {
  const PosedSkeleton posed = forward_kinematics(body.joints, pose);
  std::vector<Vec3> out(body.rest.vertices.size());
  for (size_t v = 0; v < out.size(); ++v) {
    const Vec3 rest = body.rest.vertices[v].cast<double>();
    out[v].setZero();
    for (int j = 0; j < kJoints; ++j)
      if (const double w = body.weights(static_cast<Eigen::Index>(v), j); w != 0)
        out[v] += w * (posed.global[j] * (rest - body.joints[j]) + posed.joints[j]);
  }
  return out;
}

Pose fit_pose(const Body& body, const Scan& scan, const Pose& start,
              const PoseFitOptions& options) {
  Pose pose = start;
  for (const double width : options.widths) {
    const std::vector<Vec3> surface = skinned(body, pose);
    const Points single = [&] {
      Points out;
      for (const Vec3& p : surface) out.push_back(p.cast<float>());
      return out;
    }();
    const auto normals = vertex_normals<Vec3>(single, body.rest.faces, Vec3::Zero());
    const auto matches = match_surface(scan, surface, normals, width);
    const PosedSkeleton posed = forward_kinematics(body.joints, pose);
    PoseEquations equations(body, posed);
    const double share = 1 / std::max(options.whole, static_cast<double>(scan.points.size()));
    for (const SurfaceMatch& m : matches)
      equations.add(m, surface[m.vertex], normals[m.vertex], share * m.weight);
    equations.hold(pose, start, options.stiffness);
    const PoseStep step = equations.solve();
    pose.root += step.head<3>();
    for (int k = 0; k < kJoints; ++k)
      pose.local[k] = turn_of(step.segment<3>(3 + 3 * k)) * pose.local[k];
  }
  for (Mat3& turn : pose.local) turn = Quat(turn).normalized().toRotationMatrix();
  return pose;
}

}  // namespace restage
