#include "datasets/importers/motions/motion_clip.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "autograd/base/format.h"
#include "datasets/importers/rigs/bone_tree.h"
#include "datasets/importers/rigs/joint_fit.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"
#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

constexpr size_t kMostClipFrames = size_t{1} << 20;  // 9.7 hours at 30 fps

/// Metres per unit; see MotionOptions::scale.
double find_scale(const Recording& recording, double given, ImportReport& report) {
  const double leg = leg_length(rest_joints(recording.motion.skeleton, recording.names.map));
  const auto says = [&](double metres, const std::string& why) {
    report.fact("units", unit_name(metres) + ", " + why + ": a leg of " + format("%.4g", leg) +
                             " units is " + format("%.2f", leg * metres) + " m");
    return metres;
  };
  if (given > 0) return says(given, "as given");
  if (recording.metres_per_unit > 0) {
    const double metres = leg * recording.metres_per_unit;
    if (metres >= 0.4 && metres < 1.4) return says(recording.metres_per_unit, "as the file says");
    report.remark("the units that the file names would make a leg of " + format("%.4g", metres) +
                  " m: found by the leg instead");
  }
  if (const LegUnit* unit = unit_of_leg(leg)) return says(unit->metres, "by the legs");
  throw InputError(report.file,
                   "a leg of " + format("%.4g", leg) + " units is no person's in any known unit",
                   "give the scale (metres per unit)");
}

void scale_lengths(Recording& recording, double scale) {
  SourceMotion& motion = recording.motion;
  for (Vec3& x : motion.skeleton.offsets) x *= scale;
  for (Vec3& x : motion.skeleton.ends) x *= scale;
  for (auto& frame : motion.position)
    for (Vec3& x : frame) x *= scale;
  for (SourceJoint& joint : recording.names.map) joint.offset *= scale;
}

/// `hips`: the pelvis' bone.
void check_root(const SourceMotion& motion, int hips, double limit, const std::string& path) {
  if (!(limit > 0)) return;
  for (size_t f = 1; f < motion.position.size(); ++f) {
    Vec3 step = Vec3::Zero();
    for (size_t m = 0; m < motion.moving.size() && motion.moving[m] <= hips; ++m)
      if (hangs_on(motion.skeleton, hips, motion.moving[m]))
        step += motion.position[f][m] - motion.position[f - 1][m];
    const double speed = step.norm() * motion.fps;
    if (speed > limit)
      throw InputError(path,
                       cat("the root jumps ", format("%.4g", step.norm()), " m from frame ", f - 1,
                           " to ", f, " (", format("%.4g", speed), " m/s)"),
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

/// Whether a recording begins with a T-pose that does not face anywhere yet and, within four
/// frames, turns its limbs away from it: as the Daz release blends by 20 to 40 degrees a frame, or
/// at once. Nobody who is recorded does: that is 2,400 degrees a second from rest.
bool begins_with_lead(const std::vector<std::vector<Quat>>& local, size_t lead) {
  const double root = local[0][0].angularDistance(Quat::Identity()) * (180.0 / M_PI);
  const bool blends = lead == 1 || largest_turn(local[1]) < 60.0;
  return root < 0.01 && blends && largest_turn(local[0]) < 30.0 &&
         largest_turn(local[std::min<size_t>(lead, 4)]) > 50.0;
}

size_t lead_of(const std::vector<std::vector<Quat>>& local, const Profile& profile) {
  const bool known = profile.lead > 0 && local.size() > profile.lead;
  return known && begins_with_lead(local, profile.lead) ? profile.lead : 0;
}

void cut_frames(SourceMotion& motion, const Profile& profile, const MotionOptions& options,
                ImportReport& report) {
  const size_t n = motion.local.size();
  const bool asked = options.drop_leading >= 0;
  const size_t first =
      asked ? static_cast<size_t>(options.drop_leading) : lead_of(motion.local, profile);
  if (first >= n)
    throw InputError(report.file, cat("has only ", n, " frames"),
                     "leave out fewer at its beginning");
  const size_t count = options.keep_frames ? std::min(options.keep_frames, n - first) : n - first;
  if (first > 0)
    report.fact("beginning",
                cat(counted(first, "frame"), " left out, ",
                    asked ? "as asked"
                          : cat("a T-pose", first > 1 ? " and a blend out of it" : "", " that ",
                                profile.title, " files begin with ({drop-leading} 0 keeps it)")));
  const auto cut = [&](auto& frames) {
    frames.erase(frames.begin() + (first + count), frames.end());
    frames.erase(frames.begin(), frames.begin() + first);
  };
  cut(motion.local);
  cut(motion.position);
}

SourceMotion at_30_fps(const SourceMotion& motion, uint64_t bytes, const std::string& path) {
  const double seconds = static_cast<double>(motion.local.size()) / motion.fps;
  if (!(seconds * kFps < static_cast<double>(kMostClipFrames)))
    throw InputError(path, "lasts " + format("%.4g", seconds) + " s",
                     "cut it into files of at most 9 hours");
  check_length(motion.local.size(), motion.skeleton.size(), motion.fps, bytes, path);
  return resample(motion);
}

/// Fingers in terms of the rest pose, in which they turn with the hands.
std::vector<FingerTurns> fingers_of(const SourceMotion& motion, const JointMap& map,
                                    const RestPose& rest) {
  const FingerBones bones = find_fingers(motion.skeleton.names, motion.skeleton.parents,
                                         {map[kLeftWrist].joint, map[kRightWrist].joint});
  std::vector<FingerTurns> out;
  if (std::all_of(bones.begin(), bones.end(), [](int b) { return b < 0; })) return out;
  for (size_t f = 0; f < motion.local.size(); ++f) {
    FingerTurns turns = source_fingers(motion, bones, f);
    for (size_t k = 0; k < turns.size(); ++k)
      if (turns[k])
        *turns[k] = rest.align * *turns[k] *
                    rest.frame[k < turns.size() / 2 ? size_t{kLeftWrist} : size_t{kRightWrist}];
    out.push_back(turns);
  }
  return out;
}

/// The frames at 30 fps in terms of the rest pose.
Poses poses_at_30_fps(const SourceMotion& motion, const JointMap& map, const RestPose& rest,
                      ImportReport& report) {
  Poses poses(motion.local.size());
  JointFit fit(rest.joints);
  for (size_t f = 0; f < poses.size(); ++f) {
    poses[f] = source_pose(motion, map, f);
    for (size_t j = 0; j < kJoints; ++j) {
      poses[f].global[j] = rest.align * poses[f].global[j] * rest.frame[j];
      poses[f].joints[j] = rest.align * poses[f].joints[j];
    }
    fit.turn(poses[f]);
  }
  fit.report(report);
  return poses;
}

/// "07_01" -> "07"; of other names the clip's id.
std::string subject_of(const std::string& name, const std::string& id) {
  const size_t bar = name.find('_');
  const bool number =
      bar != std::string::npos && bar > 0 && name.find_first_not_of("0123456789") == bar;
  return number ? name.substr(0, bar) : id;
}

void report_names(const Recording& recording, ImportReport& report) {
  report.fact("format", cat(recording.format, ", ", recording.motion.skeleton.size(), " joints, ",
                            recording.motion.local.size(), " frames"));
  const Profile& profile = *recording.names.profile;
  std::string placed = joined(recording.names.placed, [](int j) { return kJointNames[j]; });
  if (!placed.empty()) placed = "; placed: " + placed;
  if (!profile.name.empty()) {
    report.fact("names", profile.title + " (profile " + profile.name + ")" + placed);
    return;
  }
  report.fact("names", profile.title + placed);
  std::vector<std::string> bones;
  for (size_t j = 0; j < kJoints; ++j)
    if (const SourceJoint& joint = recording.names.map[j]; joint.offset.isZero())
      bones.push_back(
          cat(kJointNames[j], " = ", text::quote(recording.motion.skeleton.names[joint.joint])));
  report.fact("joints", joined(bones));
}

/// Bones that the file moves apart are of one length here, which is said where it is seen.
void report_positions(const BonePositions& found, double scale, ImportReport& report) {
  constexpr double kSeen = 0.001;  // metres
  if (found.off_offset * scale > kSeen)
    report.fact("offsets", cat("by the position channels of ", found.joints, " joints, up to ",
                               format("%.3f", found.off_offset * scale), " m from OFFSET"));
  if (found.stray * scale > kSeen)
    report.remark("the position channels stretch bones: " + text::quote(found.stray_joint) +
                  " strays up to " + format("%.3f", found.stray * scale) +
                  " m from its mean place, which is taken");
}

/// Where the file differs from what its family usually is.
void compare_with_profile(const Profile& profile, double scale, double fps, ImportReport& report) {
  const auto differs = [&](const std::string& what, const std::string& is,
                           const std::string& usual) {
    report.remark(profile.title + " files usually have " + what + " " + usual + ", this one " + is);
  };
  if (!profile.units.empty() && unit_name(scale) != profile.units)
    differs("units of", unit_name(scale), profile.units);
  for (const auto& [name, value] : report.facts)
    if (name == "up" && !profile.up.empty() && value.substr(0, value.find(',')) != profile.up)
      differs("up axis", value.substr(0, value.find(',')), profile.up);
  if (profile.fps > 0 && std::abs(fps / profile.fps - 1) > 1e-3)
    differs("a rate of", format("%.6g", fps) + " fps", format("%.6g", profile.fps) + " fps");
}

}  // namespace

MotionClip make_clip(Recording recording, const std::string& path, const MotionOptions& options) {
  MotionClip clip;
  ImportReport& report = clip.report;
  report.file = path;
  report_names(recording, report);
  report.remarks = recording.remarks;
  clip.scale = find_scale(recording, options.scale, report);
  scale_lengths(recording, clip.scale);
  report_positions(recording.positions, clip.scale, report);
  SourceMotion& motion = recording.motion;
  if (options.fps > 0) motion.fps = options.fps;
  check_root(motion, recording.names.map[0].joint, options.max_root_speed, path);
  const JointMap& map = recording.names.map;
  const RestPose rest = find_rest_pose(motion, map, options.rest, report);
  check_handedness(rest.joints, options.force, report);
  const auto hips = static_cast<size_t>(map[kPelvis].joint);
  clip.rest_y =
      (rest.align * (motion.skeleton.offsets[0] + zero_positions(motion.skeleton)[hips])).y();
  cut_frames(motion, *recording.names.profile, options, report);
  const double fps = motion.fps;
  const size_t frames = motion.local.size();
  motion = at_30_fps(motion, recording.bytes, path);
  const Poses poses = poses_at_30_fps(motion, map, rest, report);
  if (options.fingers) clip.fingers = fingers_of(motion, map, rest);
  clip.joints.reserve(poses.size());
  report.fact("rate", (fps == kFps ? "30 fps, taken as they are"
                                   : cat(format("%.6g", fps), " fps -> 30 fps, slerp: ", frames,
                                         " frames -> ", poses.size())) +
                          (options.fps > 0        ? " (as given; " + recording.rate_of_file + ")"
                           : recording.rate_known ? std::string()
                                                  : " (" + recording.rate_of_file + ")"));
  compare_with_profile(*recording.names.profile, clip.scale, fps, report);
  for (const PosedSkeleton& pose : poses) clip.joints.push_back(pose.joints);
  clip.floor_y = floor_height(poses);
  report.fact("floor", format("%.3f", clip.floor_y) + " m in the file's world, moved to 0");
  clip.motion = to_motion(poses, rest.joints, clip.floor_y);
  clip.motion.id = options.id.empty() ? stem_of(path) : options.id;
  clip.motion.subject =
      options.subject.empty() ? subject_of(stem_of(path), clip.motion.id) : options.subject;
  clip.motion.split = options.split;
  clip.motion.action = options.action;
  return clip;
}

std::optional<Profile> asked_profile(const MotionOptions& options) {
  if (options.profile.empty()) return std::nullopt;
  return find_profile(options.profile);
}

std::string stem_of(const std::string& path) {
  std::string name = std::filesystem::path(path).filename().string();
  for (const std::string_view tail : {".xz", ".bvh", ".amc", ".asf"})
    if (lower_case(name).ends_with(tail)) name.resize(name.size() - tail.size());
  return name;
}

}  // namespace restage
