#include "datasets/importers/rigs/twist_bones.h"

#include <algorithm>
#include <cmath>

#include "autograd/base/words.h"

namespace restage {
namespace {

constexpr size_t kNextOnArm = 2;  // from a shoulder to its elbow, from an elbow to its wrist

Vec3 line_of(size_t joint, const Joints& rest) {
  return (rest[joint + kNextOnArm] - rest[joint]).normalized();
}

/// The turn of `to` about the line, seen from `from`, radians. It fades out between 150 and 180
/// degrees, where its sign cannot be told.
double twist(const Mat3& from, const Mat3& to, const Vec3& line) {
  constexpr double kFades = 150 * M_PI / 180;
  const Quat turn(Mat3(from.transpose() * to));
  double angle = 2 * std::atan2(turn.vec().dot(line), turn.w());
  if (angle > M_PI) angle -= 2 * M_PI;
  if (angle < -M_PI) angle += 2 * M_PI;
  return angle * std::clamp((M_PI - std::abs(angle)) / (M_PI - kFades), 0.0, 1.0);
}

Mat3 about(const Vec3& line, double angle) {
  return Eigen::AngleAxisd(angle, line).toRotationMatrix();
}

bool is_small(char c) { return c >= 'a' && c <= 'z'; }

/// Whether the name has the word: "ForeArmRoll" and "forearm_roll.L" have "roll", "Scroll" has not.
bool has_word(const std::string& name, const std::string& word) {
  const std::string low = lower_case(name);
  for (size_t at = low.find(word); at != low.npos; at = low.find(word, at + 1)) {
    const size_t end = at + word.size();
    const bool begins = at == 0 || !is_small(name[at]) || !is_small(name[at - 1]);
    if (begins && (end == name.size() || !is_small(name[end]))) return true;
  }
  return false;
}

bool is_called_twist(const std::string& name) {
  const std::string low = lower_case(name);
  const bool called =
      low.find("twist") != low.npos || low.find("armroll") != low.npos || has_word(name, "roll");
  return called && !has_word(name, "end");
}

/// Whether the next joint of the limb hangs on the node.
bool carries(const Gltf& file, const GltfRig& rig, int node, size_t joint) {
  for (int n = rig.node[joint + kNextOnArm]; n >= 0; n = file.nodes[static_cast<size_t>(n)].parent)
    if (n == node) return true;
  return false;
}

}  // namespace

std::vector<TwistBone> find_twist_bones(const Gltf& file, const GltfRig& rig, const Joints& rest,
                                        const std::vector<int>& joint_of) {
  constexpr double kAtJoint = 0.05;  // of the limb
  std::vector<TwistBone> out;
  for (size_t n = 0; n < file.nodes.size(); ++n) {
    const auto joint = static_cast<size_t>(std::max(rig.joint[n], 0));
    const auto node = static_cast<int>(n);
    const bool stray = std::find(rig.strays.begin(), rig.strays.end(), node) != rig.strays.end();
    if (joint_of[n] >= 0 && !stray) continue;
    if (joint < kLeftShoulder || joint > kRightElbow) continue;
    if (!rig.offset[joint].isZero() || !rig.offset[joint + kNextOnArm].isZero()) continue;
    const bool between = carries(file, rig, node, joint);
    if (!between && !is_called_twist(file.nodes[n].name)) continue;
    const Vec3 limb = rest[joint + kNextOnArm] - rest[joint];
    if (!(limb.norm() > 1e-6)) continue;
    const Vec3 from = rig.to_ours(rig.t_pose[n].translation()) -
                      rig.to_ours(rig.t_pose[static_cast<size_t>(rig.node[joint])].translation());
    double along = std::clamp(limb.dot(from) / limb.squaredNorm(), 0.0, 1.0);
    // One that lies at the elbow is meant for the forearm's middle.
    if (joint >= kLeftElbow && along < kAtJoint) along = 0.5;
    out.push_back({node, joint, along});
  }
  return out;
}

Mat3 twist_of(const TwistBone& bone, const Joints& rest, const Rotations& global) {
  const size_t j = bone.joint;
  const Vec3 line = line_of(j, rest);
  if (j >= kLeftElbow)
    return about(line, bone.along * twist(global[j], global[j + kNextOnArm], line));
  const auto above = static_cast<size_t>(kParents[j]);
  return about(line, -(1 - bone.along) * twist(global[above], global[j], line));
}

void share_twist(int side, const Joints& rest, Rotations* global) {
  constexpr double kFree = 75 * M_PI / 180, kShare = 2.0 / 3;
  const auto elbow = static_cast<size_t>(kLeftElbow + side);
  const Vec3 line = line_of(elbow, rest);
  if (!(line.norm() > 0.5)) return;  // two joints in one place
  const double angle = twist((*global)[elbow], (*global)[elbow + kNextOnArm], line);
  const double over = std::abs(angle) - kFree;
  if (over > 0) (*global)[elbow] *= about(line, std::copysign(kShare * over, angle));
}

}  // namespace restage
