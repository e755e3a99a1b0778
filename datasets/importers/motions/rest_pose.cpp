#include "datasets/importers/motions/rest_pose.h"

#include <cmath>

#include "datasets/doctor/examine.h"
#include "datasets/importers/motions/t_pose.h"
#include "datasets/readers/errors.h"

namespace restage {
namespace {

constexpr double kDegrees = 180.0 / M_PI;
constexpr double kShownAngle = 5;  // limbs further off are listed
constexpr double kMostTrunk = 45;  // more off the vertical is no standing pose
constexpr double kMostLimb = 120;  // more cannot be corrected by shortest arcs

double degrees_between(const Vec3& a, const Vec3& b) { return angle_between(a, b) * kDegrees; }

Vec3 standing(const Joints& joints) { return joints[15] - 0.5 * (joints[7] + joints[8]); }

/// From the ankles to the head on average over (at most 2,000 frames of) the recording.
Vec3 standing(const SourceMotion& motion, const JointMap& map) {
  Vec3 sum = Vec3::Zero();
  const size_t step = (motion.local.size() + 1999) / 2000;
  size_t count = 0;
  for (size_t f = 0; f < motion.local.size(); f += step, ++count)
    sum += standing(source_pose(motion, map, f).joints);
  return sum / static_cast<double>(std::max<size_t>(count, 1));
}

bool along_an_axis(const Vec3& v, double length) {
  return v.norm() > length && v.cwiseAbs().maxCoeff() > 0.7 * v.norm();
}

Axis find_up(const SourceMotion& motion, const JointMap& map, const Joints& rest, Axis given,
             ImportReport& report) {
  if (given != Axis::automatic) {
    report.fact("up", to_string(given) + ", as given");
    return given;
  }
  const double leg = leg_length(rest);
  const Vec3 in_rest = standing(rest), moving = standing(motion, map);
  const Axis by_rest = axis_near(in_rest), by_motion = axis_near(moving);
  const bool rest_stands = along_an_axis(in_rest, 1.1 * leg);
  const bool motion_stands = along_an_axis(moving, 0.8 * leg);
  if (rest_stands &&
      (std::abs(vector_of(by_rest).x()) < 0.5 || !motion_stands || by_rest == by_motion)) {
    report.fact("up", to_string(by_rest) + ", by the rest pose");
    if (motion_stands && by_motion != by_rest)
      report.remark("up is " + to_string(by_rest) +
                    " in the rest pose, but the head is "
                    "over the ankles along " +
                    to_string(by_motion) + " in the recording: if nobody lies there, give {up} " +
                    to_string(by_motion));
    return by_rest;
  }
  if (!motion_stands)
    throw InputError(report.file,
                     "neither the rest pose nor the recording stands, so up is not known",
                     "say which axis is up ({up})");
  report.fact("up", to_string(by_motion) + ", by the recording");
  return by_motion;
}

/// Turn about y that brings an upright pose to face +z.
Mat3 facing_front(const Joints& rest, const Vec3& given, bool framed, const std::string& path) {
  const Vec3 left = (rest[1] - rest[2]) + (rest[16] - rest[17]);
  if (!(std::hypot(left.x(), left.z()) > 1e-6))
    throw InputError(path, "left and right joints lie on the line of the trunk",
                     "correct the skeleton");
  double yaw = std::atan2(left.z(), left.x());  // turning by +yaw about y takes `left` to +x
  if (!given.isZero()) {
    if (std::abs(given.y()) > 0.5)
      throw InputError(path, "stands along the axis that {facing} names",
                       "give {facing} across its up axis");
    if (given.cross(left).y() < 0)  // left is at the right hand of who faces there
      throw InputError(path, "for a person facing that way, its left joints are on the right",
                       "give the other {facing}; if the file is mirrored, mend its names");
    yaw = -std::atan2(given.x(), given.z());
  }
  return framed ? turn_about_y(yaw) : turn_in_quarters(yaw);
}

/// What keeps a pose from being T-like; "" if nothing does.
std::string unlike_t_pose(const Joints& rest) {
  const double trunk = degrees_between(rest[15] - rest[0], Vec3::UnitY());
  if (!(trunk <= kMostTrunk)) return "its trunk is not upright";
  for (const Limb& limb : t_pose_limbs()) {
    const Vec3 bone = rest[limb.to] - rest[limb.from];
    if (!(bone.norm() > 1e-4) || !(degrees_between(bone, limb.wanted) <= kMostLimb))
      return cat("its ", kJointNames[limb.from], " does not point towards the ",
                 kJointNames[limb.to], " as a standing person's");
  }
  return "";
}

/// "left_hip 20, right_hip 20 degrees": limbs off a T-pose.
std::string limbs_off(const Joints& rest) {
  std::vector<std::string> out;
  for (const Limb& limb : t_pose_limbs()) {
    const double angle = degrees_between(rest[limb.to] - rest[limb.from], limb.wanted);
    if (angle >= kShownAngle) out.push_back(cat(kJointNames[limb.from], " ", std::lround(angle)));
  }
  return out.empty() ? "" : joined(out) + " degrees";
}

RestPose built_pose(const SourceMotion& motion, const JointMap& map, const Joints& zero,
                    const Mat3& up, ImportReport& report) {
  const Rotations turned = build_t_pose(motion, map, up, report.file);
  RestPose out;
  out.align = up;
  Joints stood;  // the zero pose as a whole, its trunk upright
  for (size_t j = 0; j < kJoints; ++j) {
    const int p = kParents[j];
    out.frame[j] = turned[j].transpose();
    stood[j] = turned[0] * (zero[j] - zero[0]);
    out.joints[j] = p < 0 ? Vec3::Zero() : Vec3(out.joints[p] + turned[p] * (zero[j] - zero[p]));
  }
  report.fact("rest pose",
              "built, for zero rotations are no T-pose: trunk upright, collars and "
              "arms along x, legs down, feet level, knees bending backwards and "
              "elbows forwards");
  report.fact("turned", limbs_off(stood));
  return out;
}

}  // namespace

const std::vector<Limb>& t_pose_limbs() {
  static const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY();
  static const std::vector<Limb> all = {{1, 4, -y},  {2, 5, -y},   {4, 7, -y},  {5, 8, -y},
                                        {16, 18, x}, {17, 19, -x}, {18, 20, x}, {19, 21, -x}};
  return all;
}

void check_handedness(const Joints& rest, bool force, ImportReport& report) {
  if (!is_mirrored(rest).value_or(false)) return;
  const std::string wrong = cat(kMirrored, " (", kMirroredBecause, ")");
  if (!force)
    throw InputError(report.file, wrong, cat(kMirroredFix, "; {force} takes it as it is"));
  report.remark(wrong + ": taken as it is");
}

RestPose find_rest_pose(const SourceMotion& motion, const JointMap& map, const RestOptions& options,
                        ImportReport& report) {
  const std::string& path = report.file;
  PosedSkeleton pose;
  pose.joints = rest_joints(motion.skeleton, map);
  pose.global.fill(Mat3::Identity());
  const bool framed = options.frame >= 0;
  if (framed) {
    if (static_cast<size_t>(options.frame) >= motion.local.size())
      throw InputError(path, cat("has no frame ", options.frame), "name a rest frame of it");
    pose = source_pose(motion, map, static_cast<size_t>(options.frame));
  }
  const Mat3 up = upright(find_up(motion, map, pose.joints, options.up, report));
  Joints upright_joints;
  for (size_t j = 0; j < kJoints; ++j) upright_joints[j] = up * (pose.joints[j] - pose.joints[0]);
  const Vec3 given =
      options.facing == Axis::automatic ? Vec3(Vec3::Zero()) : Vec3(up * vector_of(options.facing));
  RestPose out;
  std::string wrong = "it does not stand";
  if (!(degrees_between(upright_joints[15], Vec3::UnitY()) > kMostTrunk)) {
    const Mat3 front = facing_front(upright_joints, given, framed, path);
    for (size_t j = 0; j < kJoints; ++j) {
      out.joints[j] = front * upright_joints[j];
      out.frame[j] = pose.global[j].transpose() * (front * up).transpose();
    }
    out.align = front * up;
    wrong = unlike_t_pose(out.joints);
  }
  if (!wrong.empty() && framed)
    throw InputError(path, cat("frame ", options.frame, " is no T-pose: ", wrong),
                     "name a frame that is a T-pose as the rest frame");
  if (!wrong.empty()) return built_pose(motion, map, pose.joints, up, report);

  const Vec3 front = out.align.transpose() * Vec3::UnitZ();
  report.fact("facing",
              to_string(axis_near(front)) +
                  (given.isZero() ? ", by the left and right joints" : ", as given") +
                  (degrees_between(front, vector_of(axis_near(front))) > 1 ? " (about)" : ""));
  report.fact("rest pose", framed ? cat("frame ", options.frame) : "zero rotations");
  const std::string off = limbs_off(out.joints);
  if (!off.empty()) report.fact("off a T-pose", off + " (corrected bone by bone for each body)");
  return out;
}

}  // namespace restage
