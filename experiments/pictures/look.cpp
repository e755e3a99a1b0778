#include "experiments/pictures/look.h"

#include <algorithm>
#include <array>
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
  float reach;   ///< metres
  int end = -1;  ///< the joint beyond which all of the surface is to be seen; -1: none
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
    return Landmark{at.cast<float>(), reach * size, joint};
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

/// Of each joint the vertices beyond it: those of heads, hands and feet.
using Ends = std::array<std::vector<size_t>, kJoints>;

/// Beyond a joint lie the vertices that are nearer to the line on which its bone goes on than to
/// any bone.
Ends ends_of(const Points& surface, const Joints& joints) {
  Ends out;
  for (size_t v = 0; v < surface.size(); ++v) {
    const Vec3 p = surface[v].cast<double>();
    double least = INFINITY;
    int end = -1;
    for (int j = 1; j < kJoints; ++j) {
      const Vec3 from = joints[kParents[j]], along = joints[j] - from;
      const bool is_end =
          j == kHead || j == kLeftWrist || j == kRightWrist || j == kLeftFoot || j == kRightFoot;
      const double share = (p - from).dot(along) / std::max(along.squaredNorm(), 1e-12);
      const double on = std::clamp(share, 0.0, is_end ? 1e9 : 1.0);
      const double away = (p - from - on * along).squaredNorm();
      if (!(away < least)) continue;
      least = away;
      end = is_end && on > (j == kLeftFoot || j == kRightFoot ? 0 : 1) ? j : -1;
    }
    if (end >= 0) out[static_cast<size_t>(end)].push_back(v);
  }
  return out;
}

/// Around the vertices beyond a landmark's joint; something long in a hand does not count.
Box end_box(const Landmark& mark, const Ends& ends, const Points& surface) {
  constexpr float kRoom = 0.1f;  // of its size, on each side
  const float most = (mark.end == kHead ? 12 : 4) * mark.reach;
  Box out;
  for (const size_t v : ends[static_cast<size_t>(mark.end)])
    if ((surface[v] - mark.at).norm() < most) out.extend(surface[v]);
  if (out.isEmpty()) return out;
  const Point room = kRoom * out.sizes();
  return {out.min() - room, out.max() + room};
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

Aim aim_at(const std::vector<Joints>& frames, const Look& look, const Clip& clip) {
  Aim aim;
  if (look.part.empty()) return aim;
  const bool surface = !clip.faces.empty() && clip.frames.size() == frames.size();
  const Ends ends = surface ? ends_of(clip.frames[0], frames[0]) : Ends();
  for (size_t f = 0; f < frames.size(); ++f) {
    Box box;
    for (const Landmark& mark : landmarks(frames[f], look.part)) {
      box.extend(Box(mark.at - Point::Constant(mark.reach), mark.at + Point::Constant(mark.reach)));
      if (surface && mark.end >= 0) box.extend(end_box(mark, ends, clip.frames[f]));
    }
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
