#include "experiments/pictures/look.h"

#include <algorithm>
#include <cmath>

#include "autograd/base/error.h"
#include "autograd/base/nearest.h"
#include "autograd/base/words.h"
#include "nn/geometry/box.h"

namespace restage {
namespace {

constexpr float kJointReach = 0.25f;  // metres

/// What is to be seen of a joint, beyond the joint itself.
struct Landmark {
  Point at;
  float reach;  ///< metres
};

/// The number of the joint of that name; kJoints: there is none.
size_t joint_of(const std::string& name) {
  return static_cast<size_t>(std::find(kJointNames.begin(), kJointNames.end(), name) -
                             kJointNames.begin());
}

std::vector<Landmark> landmarks(const Joints& joints, const std::string& part) {
  const auto leg = (joints[kLeftHip] - joints[kLeftKnee]).norm() +
                   (joints[kLeftKnee] - joints[kLeftAnkle]).norm();
  const auto size = static_cast<float>(leg / 0.85);  // of the person; 1: about 1.75 m tall
  const auto beyond = [&](int joint, int before, double share, float reach) {
    const Vec3 at = joints[joint] + share * (joints[joint] - joints[before]);
    return Landmark{at.cast<float>(), reach * size};
  };
  if (part == "head") return {beyond(kHead, kNeck, 0.7, 0.2f)};
  if (part == "feet")
    return {beyond(kLeftFoot, kLeftAnkle, 0, 0.2f), beyond(kRightFoot, kRightAnkle, 0, 0.2f)};
  if (const size_t joint = joint_of(part); joint < kJoints)
    return {{joints[joint].cast<float>(), kJointReach}};
  std::vector<Landmark> out;
  if (part != "right-hand") out.push_back(beyond(kLeftWrist, kLeftElbow, 0.35, 0.18f));
  if (part != "left-hand") out.push_back(beyond(kRightWrist, kRightElbow, 0.35, 0.18f));
  return out;
}

}  // namespace

void check_look(const Look& look) {
  std::vector<std::string> parts = {"head", "hands", "left-hand", "right-hand", "feet"};
  parts.insert(parts.end(), kJointNames.begin(), kJointNames.end());
  if (look.part.empty() || std::find(parts.begin(), parts.end(), look.part) != parts.end()) return;
  const std::string near = nearest(look.part, parts);
  throw InputError(
      "", "there is no part '" + look.part + "' to look at",
      near.empty() ? "use one of " + cut_list(parts, 150) : "did you mean '" + near + "'?");
}

Aim aim_at(const std::vector<Joints>& frames, const Look& look) {
  Aim aim;
  if (look.part.empty()) return aim;
  for (const Joints& frame : frames) {
    Box box;
    for (const Landmark& mark : landmarks(frame, look.part))
      box.extend(Box(mark.at - Point::Constant(mark.reach), mark.at + Point::Constant(mark.reach)));
    aim.focus.push_back(box.center());
    aim.close_up = std::max(aim.close_up, 0.5 * static_cast<double>(box.sizes().maxCoeff()));
  }
  if (look.within) aim.close_up = *look.within;
  return aim;
}

double facing(const Joints& joints) {
  const Vec3 left =
      joints[kLeftHip] - joints[kRightHip] + joints[kLeftShoulder] - joints[kRightShoulder];
  return std::hypot(left.x(), left.z()) > 1e-6 ? std::atan2(-left.z(), left.x()) * 180 / M_PI : 0;
}

}  // namespace restage
