#include "datasets/importers/motions/t_pose.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "datasets/doctor/shape.h"
#include "datasets/readers/errors.h"

namespace restage {
namespace {

constexpr size_t kMostFrames = 2000;  // looked at, evenly spread
constexpr double kBends = 0.1;        // mean sine of a knee's or elbow's angle that shows its side

/// The child that a joint's bone leads to; -1: the joint keeps the zero pose's rotation against its
/// parent (head, hands), or takes the recording's mean (toes).
constexpr int kBone[kJoints] = {-1, 4,  5,  6,  7,  8,  9,  10, 11, 12, -1,
                                -1, 15, 16, 17, -1, 18, 19, 20, 21, -1, -1};

Vec3 direction(const Vec3& v) { return v.norm() > 1e-9 ? Vec3(v.normalized()) : Vec3::Zero(); }

/// Mean of rotations, each with a weight: the largest eigenvector of the sum of q q^T.
class MeanRotation {
 public:
  void add(const Mat3& rotation, double weight) {
    const Eigen::Vector4d q = Quat(rotation).coeffs();
    sum_ += weight * q * q.transpose();
    weight_ += weight;
  }
  double weight() const { return weight_; }
  Mat3 mean() const {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(sum_);
    const Eigen::Vector4d q = solver.eigenvectors().col(3);
    return Quat(q.w(), q.x(), q.y(), q.z()).normalized().toRotationMatrix();
  }

 private:
  Eigen::Matrix4d sum_ = Eigen::Matrix4d::Zero();
  double weight_ = 0;
};

class Builder {
 public:
  Builder(const SourceMotion& motion, const JointMap& map, const Mat3& align,
          const std::string& path)
      : path_(path), align_(align), zero_(rest_joints(motion.skeleton, map)) {
    const size_t n = motion.local.size(), step = (n + kMostFrames - 1) / kMostFrames;
    for (size_t f = 0; f < n; f += step) poses_.push_back(source_pose(motion, map, f));
  }

  Rotations build() {
    stand_trunk();
    for (int j = 1; j < kJoints; ++j) {
      out_[j] = out_[kParents[j]] * turned(j);
      if (j == 1 || j == 2) twist(j, -Vec3::UnitZ());   // knees bend backwards
      if (j == 16 || j == 17) twist(j, Vec3::UnitZ());  // elbows bend forwards
    }
    return out_;
  }

 private:
  static bool in_trunk(int j) { return j == 3 || j == 6 || j == 9 || j == 12; }

  Vec3 bone(int j) const { return direction(zero_[kBone[j]] - zero_[j]); }
  /// Rotation of joint j against its parent.
  static Mat3 local(const PosedSkeleton& pose, int j) {
    return pose.global[kParents[j]].transpose() * pose.global[j];
  }

  /// Whether pelvis, spine and head lie on a line in the zero pose.
  bool straight() const {
    double length = 0;
    for (const int j : {3, 6, 9, 12, 15}) length += (zero_[j] - zero_[kParents[j]]).norm();
    return zero_[15].norm() > 0.8 * length;
  }

  void stand_trunk() {
    Vec3 up = zero_[15];
    straight_ = straight();
    if (!straight_) {
      up.setZero();
      for (const PosedSkeleton& pose : poses_)
        up += pose.global[0].transpose() * (pose.joints[15] - pose.joints[0]);
    }
    up = direction(up);
    const Vec3 hips = zero_[1] - zero_[2];
    const Vec3 left = direction(hips - up * up.dot(hips));
    if (up.isZero() || left.isZero())
      throw InputError(path_, "the hips lie on the line of the trunk, so that front is not known",
                       "correct the skeleton");
    Mat3 ours;  // columns: left, up, front in the zero pose
    ours << left, up, left.cross(up);
    out_[0] = ours.transpose();
  }

  /// Where the bone of joint j points in a T-pose.
  Vec3 target(int j) const {
    if (j == 1 || j == 2 || j == 4 || j == 5) return -Vec3::UnitY();
    if (j == 7 || j == 8) return foot_direction(j);
    if (in_trunk(j)) return Vec3::UnitY();
    const bool left = j == 13 || j == 16 || j == 18;
    return left ? Vec3(Vec3::UnitX()) : Vec3(-Vec3::UnitX());
  }

  /// Forward, and as steep as the foot is on the floor: in the frames with the lowest ankle.
  Vec3 foot_direction(int ankle) const {
    std::vector<std::pair<double, double>> height_and_pitch;
    for (const PosedSkeleton& pose : poses_) {
      const Vec3 foot = direction(align_ * (pose.joints[kBone[ankle]] - pose.joints[ankle]));
      height_and_pitch.emplace_back((align_ * pose.joints[ankle]).y(),
                                    std::asin(std::clamp(foot.y(), -1.0, 1.0)));
    }
    std::sort(height_and_pitch.begin(), height_and_pitch.end());
    const size_t lowest = (height_and_pitch.size() + 3) / 4;
    std::vector<double> pitch;
    for (size_t i = 0; i < lowest; ++i) pitch.push_back(height_and_pitch[i].second);
    const double angle = std::clamp(median(std::move(pitch)), -M_PI / 3, M_PI / 9);
    return Vec3(0, std::sin(angle), std::cos(angle));
  }

  /// Rotation of joint j against its parent in the T-pose.
  Mat3 turned(int j) const {
    const int child = kBone[j];
    if (child < 0 && j != 10 && j != 11) return Mat3::Identity();
    if (in_trunk(j) && straight_) return Mat3::Identity();
    MeanRotation mean;
    if (child < 0) {
      for (const PosedSkeleton& pose : poses_) mean.add(local(pose, j), 1.0);
      return mean.mean();
    }
    const Vec3 wanted = out_[kParents[j]].transpose() * target(j), along = bone(j);
    for (const PosedSkeleton& pose : poses_) {
      const Mat3 rotation = local(pose, j);
      const Vec3 now = rotation * along;
      // A long arc says little of the twist, and one of 180 degrees nothing.
      const double near = std::max(0.0, 0.5 * (1.0 + now.dot(wanted)));
      mean.add(shortest_arc(now, wanted) * rotation, near * near);
    }
    if (along.isZero() || mean.weight() < 1e-3 * static_cast<double>(poses_.size()))
      throw InputError(path_,
                       cat("the zero pose is no T-pose, and none can be built: the ",
                           kJointNames[j], " never points anywhere near its place in one"),
                       "name a frame that is a T-pose as the rest frame");
    return mean.mean();
  }

  /// Turns joint j about its own bone so that the next bone bends to `side`; as it is if the
  /// recording hardly bends it.
  void twist(int j, const Vec3& side) {
    const int next = kBone[j];
    const Vec3 along = bone(j), next_along = bone(next);
    Vec3 bend = Vec3::Zero();
    for (const PosedSkeleton& pose : poses_) bend += local(pose, next) * next_along;
    bend -= along * along.dot(bend);
    if (!(bend.norm() > kBends * static_cast<double>(poses_.size()))) return;
    const Vec3 axis = out_[j] * along, now = direction(out_[j] * bend);
    const double angle = std::atan2(axis.dot(now.cross(side)), now.dot(side));
    out_[j] = Eigen::AngleAxisd(angle, axis).toRotationMatrix() * out_[j];
  }

  const std::string& path_;
  const Mat3 align_;
  const Joints zero_;
  std::vector<PosedSkeleton> poses_;
  Rotations out_;
  bool straight_ = true;
};

}  // namespace

Rotations build_t_pose(const SourceMotion& motion, const JointMap& map, const Mat3& align,
                       const std::string& path) {
  return Builder(motion, map, align, path).build();
}

}  // namespace restage
