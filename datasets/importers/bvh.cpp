#include "datasets/importers/bvh.h"

#include <cmath>
#include <cstdio>
#include <filesystem>

#include "autograd/base/error.h"
#include "datasets/importers/bvh_file.h"

namespace restage {
namespace {

constexpr size_t kMaxFrames = size_t{1} << 20;  // 9.7 hours at 30 fps

std::string text_of(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

/// Metres per unit by the length of a leg in units; see BvhOptions::scale.
double guess_scale(double leg, const std::string& path) {
  struct Unit {
    double from, to, metres;
  };
  constexpr Unit kUnits[] = {{0.4, 1.4, 1.0},  {4, 10, 0.1},    {10, 20, 0.0254 / 0.45},
                             {20, 50, 0.0254}, {50, 140, 0.01}, {400, 1400, 0.001}};
  for (const Unit& unit : kUnits)
    if (leg >= unit.from && leg < unit.to) return unit.metres;
  throw InputError(path, "a leg of " + text_of(leg) + " units is no person's in any known unit",
                   "give the scale (metres per unit)");
}

double frame_rate(const BvhFile& file, const BvhOptions& options) {
  if (options.fps > 0) return options.fps;
  const double fps = 1.0 / file.frame_time;
  return std::abs(fps / std::round(fps) - 1.0) < 5e-4 ? std::round(fps) : fps;
}

void scale_lengths(SourceMotion& motion, double scale) {
  for (Vec3& x : motion.skeleton.offsets) x *= scale;
  for (Vec3& x : motion.skeleton.ends) x *= scale;
  for (auto& frame : motion.position)
    for (Vec3& x : frame) x *= scale;
}

void check_root(const SourceMotion& motion, double limit, const std::string& path) {
  if (!(limit > 0)) return;
  for (size_t f = 1; f < motion.position.size(); ++f) {
    Vec3 step = Vec3::Zero();
    for (size_t m = 0; m < motion.moving.size(); ++m)
      step += motion.position[f][m] - motion.position[f - 1][m];
    const double speed = step.norm() * motion.fps;
    if (speed > limit)
      throw InputError(path,
                       "the root jumps " + text_of(step.norm()) + " m from frame " +
                           std::to_string(f - 1) + " to " + std::to_string(f) + " (" +
                           text_of(speed) + " m/s)",
                       "the recording is broken there: cut it, or check frame rate and scale");
  }
}

/// Largest turn of a joint other than the root against the zero pose, degrees.
double largest_turn(const std::vector<Quat>& local) {
  double largest = 0;
  for (size_t j = 1; j < local.size(); ++j)
    largest = std::max(largest, local[j].angularDistance(Quat::Identity()));
  return largest * (180.0 / M_PI);
}

/// How many frames the Daz release's T-pose and the blend out of it take (0: none are there).
size_t t_pose_lead(const std::vector<std::vector<Quat>>& local) {
  constexpr size_t kDazLead = 11;
  const bool lead = local.size() > kDazLead && largest_turn(local[0]) < 30.0 &&
                    largest_turn(local[kDazLead]) > 45.0;
  return lead ? kDazLead : 0;
}

void cut_frames(SourceMotion& motion, const BvhOptions& options, const std::string& path) {
  const size_t n = motion.local.size();
  const size_t first = options.drop_leading < 0 ? t_pose_lead(motion.local)
                                                : static_cast<size_t>(options.drop_leading);
  if (first >= n)
    throw InputError(path, "has only " + std::to_string(n) + " frames",
                     "leave out fewer at its beginning");
  const size_t count = options.keep_frames ? std::min(options.keep_frames, n - first) : n - first;
  const auto cut = [&](auto& frames) {
    frames.erase(frames.begin() + static_cast<std::ptrdiff_t>(first + count), frames.end());
    frames.erase(frames.begin(), frames.begin() + static_cast<std::ptrdiff_t>(first));
  };
  cut(motion.local);
  cut(motion.position);
}

/// Rotation that makes y the up axis, by the option or by where the head is.
Mat3 upright(const Joints& rest, UpAxis up, const std::string& path) {
  const Vec3 body = rest[15] - 0.5 * (rest[7] + rest[8]);
  int axis = 1;
  if (up == UpAxis::z) axis = 2;
  if (up == UpAxis::automatic) body.cwiseAbs().maxCoeff(&axis);
  if (axis == 0) throw InputError(path, "the rest pose stands along x", "export it with y or z up");
  Mat3 out = Mat3::Identity();
  if (axis == 2) out << 1, 0, 0, 0, 0, 1, 0, -1, 0;  // (x, y, z) -> (x, z, -y)
  return out;
}

/// Turn about y that brings the left side of an upright rest pose to +x.
Mat3 facing_front(const Joints& rest, bool exact) {
  const Vec3 left = (rest[1] - rest[2]) + (rest[16] - rest[17]);
  double yaw = std::atan2(left.z(), left.x());  // turning by +yaw about y takes `left` to +x
  if (!exact) yaw = std::round(yaw / (M_PI / 2)) * (M_PI / 2);
  const double c = std::round(std::cos(yaw)), s = std::round(std::sin(yaw));
  Mat3 out = Eigen::AngleAxisd(yaw, Vec3::UnitY()).toRotationMatrix();
  if (!exact) out << c, 0, s, 0, 1, 0, -s, 0, c;
  return out;
}

/// Limbs more than 120 degrees off the T-pose could not be corrected by shortest arcs.
void check_t_like(const Joints& rest, const std::string& path) {
  struct Limb {
    int from, to;
    Vec3 wanted;
  };
  const Limb limbs[] = {{1, 4, -Vec3::UnitY()},  {2, 5, -Vec3::UnitY()},   {4, 7, -Vec3::UnitY()},
                        {5, 8, -Vec3::UnitY()},  {16, 18, Vec3::UnitX()},  {17, 19, -Vec3::UnitX()},
                        {18, 20, Vec3::UnitX()}, {19, 21, -Vec3::UnitX()}, {0, 15, Vec3::UnitY()}};
  for (const Limb& limb : limbs) {
    const Vec3 bone = rest[limb.to] - rest[limb.from];
    if (!(bone.dot(limb.wanted) > -0.5 * bone.norm()) || !(bone.norm() > 1e-4))
      throw InputError(path,
                       "the rest pose is no T-pose: its " + std::string(kJointNames[limb.from]) +
                           " does not point towards the " + std::string(kJointNames[limb.to]) +
                           " as a standing person's",
                       "name a frame that is a T-pose as the rest frame");
  }
}

std::string stem_of(const std::string& path) {
  std::string name = std::filesystem::path(path).filename().string();
  for (const std::string_view tail : {".xz", ".bvh", ".BVH"})
    if (name.ends_with(tail)) name.resize(name.size() - tail.size());
  return name;
}

/// "07_01" -> "07"; other names stand for themselves.
std::string subject_of(const std::string& id) {
  const size_t bar = id.find('_');
  const bool number =
      bar != std::string::npos && bar > 0 && id.find_first_not_of("0123456789") == bar;
  return number ? id.substr(0, bar) : id;
}

/// The source's rest pose, upright and facing +z, and how to bring poses into its terms.
struct RestPose {
  Joints joints;
  Rotations undo;  ///< rotations of the joints in that pose
  Mat3 align;      ///< from the file's axes to ours
};

RestPose rest_pose(const SourceMotion& motion, const JointMap& map, const BvhOptions& options,
                   const std::string& path) {
  PosedSkeleton pose;
  pose.joints = rest_joints(motion.skeleton, map);
  pose.global.fill(Mat3::Identity());
  const bool framed = options.rest_frame >= 0;
  if (framed) {
    if (static_cast<size_t>(options.rest_frame) >= motion.local.size())
      throw InputError(path, "has no frame " + std::to_string(options.rest_frame),
                       "name a rest frame of it");
    pose = source_pose(motion, map, static_cast<size_t>(options.rest_frame));
  }
  RestPose out;
  out.undo = pose.global;
  const Mat3 up = upright(pose.joints, options.up, path);
  for (Vec3& x : pose.joints) x = up * x;
  const Mat3 front = facing_front(pose.joints, framed);
  for (int j = 0; j < kJoints; ++j) out.joints[j] = front * (pose.joints[j] - pose.joints[0]);
  out.align = front * up;
  check_t_like(out.joints, path);
  return out;
}

/// The frames at 30 fps in terms of the rest pose.
std::vector<PosedSkeleton> poses_at_30_fps(SourceMotion motion, const JointMap& map,
                                           const RestPose& rest, const std::string& path) {
  const double seconds = static_cast<double>(motion.local.size()) / motion.fps;
  if (!(seconds * kFps < static_cast<double>(kMaxFrames)))
    throw InputError(path, "lasts " + text_of(seconds) + " s",
                     "cut it into files of at most 9 hours");
  motion = resample(motion);
  std::vector<PosedSkeleton> poses(motion.local.size());
  for (size_t f = 0; f < poses.size(); ++f) {
    poses[f] = source_pose(motion, map, f);
    for (int j = 0; j < kJoints; ++j) {
      const Mat3 from_rest = poses[f].global[j] * rest.undo[j].transpose();
      poses[f].global[j] = rest.align * from_rest * rest.align.transpose();
      poses[f].joints[j] = rest.align * poses[f].joints[j];
    }
  }
  return poses;
}

}  // namespace

BvhClip convert_bvh(std::string_view text, const std::string& path, const BvhOptions& options) {
  const BvhFile file = parse_bvh(text, path);
  JointMap map = map_joints(file.skeleton, path);
  const double leg = leg_length(rest_joints(file.skeleton, map));
  BvhClip clip;
  clip.scale = options.scale > 0 ? options.scale : guess_scale(leg, path);
  SourceMotion motion = bvh_motion(file, map[0].joint);
  motion.fps = frame_rate(file, options);
  scale_lengths(motion, clip.scale);
  map = map_joints(motion.skeleton, path);  // the same joints, their offsets in metres
  check_root(motion, options.max_root_speed, path);
  const RestPose rest = rest_pose(motion, map, options, path);
  cut_frames(motion, options, path);
  const std::vector<PosedSkeleton> poses = poses_at_30_fps(std::move(motion), map, rest, path);
  for (const PosedSkeleton& pose : poses) clip.joints.push_back(pose.joints);
  clip.floor_y = floor_height(poses);
  clip.motion = to_motion(poses, rest.joints, clip.floor_y);
  clip.motion.id = stem_of(path);
  clip.motion.subject = options.subject.empty() ? subject_of(clip.motion.id) : options.subject;
  clip.motion.split = options.split;
  clip.motion.action = options.action;
  return clip;
}

BvhClip read_bvh(const std::string& path, const BvhOptions& options) {
  return convert_bvh(read_bvh_text(path), path, options);
}

Motion import_bvh(const std::string& path, const BvhOptions& options) {
  return read_bvh(path, options).motion;
}

}  // namespace restage
