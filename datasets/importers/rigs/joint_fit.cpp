#include "datasets/importers/rigs/joint_fit.h"

#include <Eigen/SVD>
#include <algorithm>
#include <vector>

#include "autograd/base/format.h"
#include "datasets/readers/errors.h"

namespace restage {
namespace {

constexpr double kRounding = 1e-5;  // of a bone's length: less is rounding

/// The rotation that takes the points `from` next to `to`, or not quite: a turn costs as much as
/// moving a point 2 cm from the joint, so that a bone of no length decides nothing.
Mat3 best_rotation(const std::vector<Vec3>& from, const std::vector<Vec3>& to) {
  constexpr double kLever = 0.02;
  Mat3 sum = kLever * kLever * Mat3::Identity();
  for (size_t i = 0; i < from.size(); ++i) sum += to[i] * from[i].transpose();
  const Eigen::JacobiSVD<Mat3> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Mat3 u = svd.matrixU(), v = svd.matrixV();
  const double sign = (u * v.transpose()).determinant() < 0 ? -1 : 1;
  return u * Vec3(1, 1, sign).asDiagonal() * v.transpose();
}

/// Turns joint j, which lies at `at` in the file's frame and at `rest_at` in the rest pose, where
/// the joints `first` to `last` on it are not where the file has them.
void turn_joint(PosedSkeleton& pose, const Joints& rest, int j, const Vec3& rest_at, const Vec3& at,
                int first, int last) {
  std::vector<Vec3> from, to;
  bool right = true;
  for (int on_it = first; on_it <= last; ++on_it) {
    if (kParents[on_it] != j) continue;
    from.push_back(pose.global[j] * (rest[on_it] - rest_at));
    to.push_back(pose.joints[on_it] - at);
    const double size = std::min(from.back().norm(), to.back().norm());
    right = right && (from.back() - to.back()).norm() <= kRounding * std::max(size, 1e-4);
  }
  if (!right) pose.global[j] = best_rotation(from, to) * pose.global[j];
}

constexpr bool in_trunk(int j) {
  return j == kSpine1 || j == kSpine2 || j == kSpine3 || j == kNeck || j == kLeftCollar ||
         j == kRightCollar;
}

}  // namespace

void JointFit::turn(PosedSkeleton& pose) {
  // A motion says where the middle of the hips is (to_motion()). The line through both turns the
  // pelvis; how it tilts says the bone that carries the legs, not the spine.
  const Vec3 rest_hips = 0.5 * (rest_[kLeftHip] + rest_[kRightHip]);
  const Vec3 hips = 0.5 * (pose.joints[kLeftHip] + pose.joints[kRightHip]);
  turn_joint(pose, rest_, kPelvis, rest_hips, hips, kLeftHip, kRightHip);
  Joints at;  // by the turns
  at[kPelvis] = hips + pose.global[kPelvis] * (rest_[kPelvis] - rest_hips);
  for (int j = 1; j < kJoints; ++j) {
    const int p = kParents[j];
    const Vec3 bone = pose.global[p] * (rest_[j] - rest_[p]);
    at[j] = at[p] + bone;
    const double off = (at[j] - pose.joints[j]).norm();
    if (off <= kRounding * bone.norm()) at[j] = pose.joints[j];  // rounding does not add up
    // Trunk and collars make up for what is off below them. A limb keeps its direction.
    turn_joint(pose, rest_, j, rest_[j], in_trunk(j) ? at[j] : pose.joints[j], j + 1, kJoints - 1);
    if (!(off <= any_.distance)) any_ = {off, j, frames_};
    if (j <= kSpine1 && !(off <= trunk_.distance)) trunk_ = {off, j, frames_};
  }
  ++frames_;
}

void JointFit::report(ImportReport& report) const {
  constexpr double kTold = 0.02, kMost = 0.25;  // metres
  if (!(trunk_.distance <= kMost))
    throw InputError(
        report.file,
        cat("the ", kJointNames[trunk_.joint], " moves up to ", format("%.2f", trunk_.distance),
            " m against the pelvis, on which it does not hang"),
        "export a skeleton whose hips carry legs and spine, or say with {bones} which "
        "bone is the pelvis");
  if (any_.distance > kTold)
    report.remark(cat("the ", kJointNames[any_.joint], " is up to ", format("%.3f", any_.distance),
                      " m (frame ", any_.frame,
                      " of the result) from where the file has it: bones that are none of the 22 "
                      "joints turn or stretch"));
}

}  // namespace restage
