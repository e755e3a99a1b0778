#include "datasets/importers/motions/skeleton_take.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "autograd/base/format.h"
#include "datasets/builtin/body_shape.h"
#include "datasets/importers/joints/solve.h"
#include "datasets/importers/motions/amass.h"
#include "datasets/importers/motions/amc.h"
#include "datasets/importers/motions/bvh.h"
#include "datasets/importers/motions/estimated.h"
#include "datasets/importers/rigs/gltf_character.h"
#include "datasets/readers/arrays/nested_file.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"
#include "datasets/schema.h"

namespace restage {
namespace {

bool is_recording(const std::string& path) {
  return text::ends_in(path, {".bvh", ".bvh.xz", ".amc", ".amc.xz"});
}

bool is_motions_name(const std::string& path) { return text::ends_in(path, {".h5", ".hdf5"}); }

double lowest_foot_of(const Joints& joints) {
  return std::min({joints[7].y(), joints[8].y(), joints[10].y(), joints[11].y()});
}

SkeletonTake of_motion(const Motion& motion, ImportReport report,
                       std::vector<FingerTurns> fingers = {}) {
  SkeletonTake out;
  out.name = motion.id;
  out.rest = motion.rest;
  out.fingers = std::move(fingers);
  out.report = std::move(report);
  const Vec3 to_pelvis = out.rest[kPelvis] - 0.5 * (out.rest[kLeftHip] + out.rest[kRightHip]);
  for (size_t f = 0; f < motion.frames(); ++f) {
    Rotations global;
    for (size_t j = 0; j < kJoints; ++j)
      global[j] = motion.global[f][j].cast<double>().normalized().toRotationMatrix();
    const Vec3 root = motion.hips[f].cast<double>() + global[kPelvis] * to_pelvis;
    out.frames.push_back(forward_kinematics(out.rest, {to_local(global), root}));
  }
  stand_on_floor(out);
  return out;
}

/// What a file of motions is asked for; there must be one answer.
SkeletonTake of_motions(const std::string& path, const TakeOptions& options) {
  const std::vector<Motion> all = read_motions(path);
  size_t chosen = 0;
  if (options.sequence) {
    chosen = static_cast<size_t>(*options.sequence);
    if (*options.sequence < 0 || chosen >= all.size())
      throw InputError(path, cat("holds ", all.size(), " motions, no number ", *options.sequence),
                       "count them from 0");
  } else if (!options.clip.empty()) {
    const auto named =
        std::find_if(all.begin(), all.end(), [&](const Motion& m) { return m.id == options.clip; });
    if (named == all.end())
      throw InputError(path, "holds no motion " + text::quote(options.clip),
                       "list them with restage data inspect");
    chosen = static_cast<size_t>(named - all.begin());
  } else if (all.size() > 1) {
    throw InputError(
        path, cat("holds ", all.size(), " motions, of which the first is ", text::quote(all[0].id)),
        "choose one with {clip} ID or {sequence} N, from 0");
  }
  ImportReport report;
  report.file = path;
  report.fact("motion", text::quote(all[chosen].id));
  return of_motion(all[chosen], std::move(report));
}

SkeletonTake of_parameters(const std::string& path, const TakeOptions& options) {
  const EstimatedMotion from = one_person(read_estimated(path), options.person, path);
  MotionOptions motion = options.motion;
  motion.id = std::filesystem::path(path).stem().string();
  ImportReport report;
  std::vector<FingerTurns> fingers;
  if (!from.person.empty()) report.fact("person", from.person);
  if (!options.body_model.empty()) {
    BodyModels models(options.body_model);
    const Motion read = import_amass(*from.arrays, models, motion, report, &fingers, from.hints);
    return of_motion(read, std::move(report), std::move(fingers));
  }
  const Joints like = options.like.value_or(shape_joints({}));
  const Motion read = import_amass(*from.arrays, like, motion, report, &fingers, from.hints);
  return of_motion(read, std::move(report), std::move(fingers));
}

JointFileOptions joint_options(const std::string& layout, const std::string& person) {
  JointFileOptions out;
  out.layout = layout;
  out.person = person;
  return out;
}

SkeletonTake of_joints(const JointRecording& joints, const std::string& path,
                       MotionOptions options) {
  options.id = std::filesystem::path(path).stem().string();
  ImportReport report;
  report.file = path;
  SolvedJoints solved = solve_joints(joints, options, report);
  return of_motion(solved.motion, std::move(report));
}

/// A body model's parameters in an archive; of joints beside them nobody is asked. What a pickle
/// holds is known when it has been looked at for joints.
bool is_estimated(const std::string& path, const std::string& layout) {
  return layout.empty() && text::ends_in(path, {".npz"}) && holds_estimates(path);
}

bool holds_motions(const std::string& path) {
  try {
    return inspect(path).counts.contains("motions");
  } catch (const InputError&) {
    return false;  // what reads clouds says what is wrong
  }
}

SkeletonTake of_recording(const std::string& path, const TakeOptions& take) {
  const MotionOptions& options = take.motion;
  const bool amc = text::ends_in(path, {".amc", ".amc.xz"});
  MotionClip clip = amc ? read_amc(path, take.asf, options) : read_bvh(path, options);
  SkeletonTake out;
  out.name = stem_of(path);
  out.rest = clip.motion.rest;
  for (Vec3& x : out.rest) x.y() += clip.rest_y - clip.motion.rest[kPelvis].y();
  out.report = std::move(clip.report);
  out.fingers = std::move(clip.fingers);
  out.frames.resize(clip.joints.size());
  for (size_t f = 0; f < out.frames.size(); ++f) {
    out.frames[f].joints = clip.joints[f];
    for (size_t j = 0; j < kJoints; ++j)
      out.frames[f].global[j] = clip.motion.global[f][j].cast<double>().toRotationMatrix();
  }
  stand_on_floor(out);
  return out;
}

/// Empty where the file has no fingers.
std::vector<FingerTurns> clip_fingers(const Gltf& file, const GltfRig& rig, const GltfClip& clip,
                                      int64_t frames) {
  std::vector<FingerTurns> out;
  const FingerBones bones = rig_fingers(file, rig);
  if (std::all_of(bones.begin(), bones.end(), [](int b) { return b < 0; })) return out;
  for (int64_t f = 0; f < frames; ++f)
    out.push_back(rig_fingers_at(
        rig, bones, gltf_pose(file, clip, clip.begin + static_cast<double>(f) / kFps)));
  return out;
}

SkeletonTake of_gltf(const std::string& path, const MotionOptions& options,
                     const std::string& name) {
  const Gltf file = read_gltf(path);
  SkeletonTake out;
  out.report.file = path;
  const GltfRig rig = find_rig(file, options, out.report);
  // A body stands on its soles, wherever its file lets it rest; bare bones, where they rest.
  if (!file.vertices.empty()) out.figure = std::make_shared<GltfOwnRig>(file, rig);
  out.rest = out.figure ? out.figure->rest() : t_pose_joints(rig);
  check_handedness(out.rest, options.force, out.report);
  const GltfClip& clip = name.empty() ? first_clip(file, rig) : find_clip(file, name);
  if (name.empty() && file.clips.size() > 1)
    out.report.remark(cat("holds ", file.clips.size(), " animations: ", text::quote(clip.name),
                          " is taken, the first that moves ({clip} NAME for another)"));
  out.name = clip.name;
  out.frames = clip_poses(file, rig, clip, clip_frames(file, clip), out.report);
  out.own_floor = true;
  out.fingers = clip_fingers(file, rig, clip, std::ssize(out.frames));
  // Where a file rests with its hips at the origin, its rest pose does not say where the floor is.
  constexpr double kNear = 0.1;  // metres
  SkeletonTake standing = out;
  stand_on_floor(standing);
  if (std::abs(standing.rest[0].y() - out.rest[0].y()) > kNear) {
    out.rest = standing.rest;
    out.report.remark("its rest pose does not stand on the floor of its animation: taken to");
  }
  return out;
}

}  // namespace

void stand_on_floor(SkeletonTake& p) {
  constexpr double kNear = 0.05;  // metres
  std::vector<double> lowest;
  for (const PosedSkeleton& frame : p.frames) lowest.push_back(lowest_foot(frame));
  const double lift = floor_height(std::move(lowest)) - lowest_foot_of(p.rest);
  if (std::abs(lift) < kNear) return;
  for (Vec3& x : p.rest) x.y() += lift;
}

bool holds_take(const std::string& path, const std::string& bones, std::string* why,
                const std::string& layout) {
  if (is_recording(path)) return true;
  std::error_code error;
  const bool folder = std::filesystem::is_directory(path, error);
  if (!folder && is_estimated(path, layout)) return true;
  if (find_joint_recording(path, joint_options(layout, "0"))) return true;  // whoever it is
  if (folder) refuse_recordings_in(path, joint_options(layout, "0"));
  if (folder) return false;
  if (may_hold_estimates(path)) return holds_estimates(path);
  if (is_motions_name(path)) return holds_motions(path);
  if (!is_gltf_name(path)) return false;
  const Gltf file = read_gltf(path);
  if (file.clips.empty()) {
    if (file.skin_nodes.empty()) return false;
    throw InputError(path, "is a character without an animation",
                     "give one that moves, or look at its surface with {from-surface}");
  }
  try {
    MotionOptions options;
    options.force = true;
    options.profile = bones;
    ImportReport ignored;
    const GltfRig rig = find_rig(file, options, ignored);
    return std::any_of(file.clips.begin(), file.clips.end(),
                       [&](const GltfClip& clip) { return moves_joints(file, rig, clip); });
  } catch (const UnknownSkeleton& unknown) {
    if (file.vertices.empty() || !bones.empty()) throw;
    if (why != nullptr) *why = unknown.reason;
  } catch (const InputError& refused) {
    if (file.vertices.empty() || !bones.empty()) throw;
    if (why != nullptr) *why = refused.what();
  }
  return false;
}

namespace {

/// Fingers that a recording only carries along say nothing.
bool fingers_move(const SkeletonTake& take) {
  constexpr double kStill = 0.01;  // radians
  for (size_t f = 0; f < take.fingers.size(); ++f)
    for (size_t k = 0; k < kFingerBones; ++k) {
      const auto hand = static_cast<size_t>(k < kFingerBones / 2 ? kLeftWrist : kRightWrist);
      const std::optional<Mat3>& turn = take.fingers[f][k];
      if (turn && Quat(*turn).angularDistance(Quat(take.frames[f].global[hand])) > kStill)
        return true;
    }
  return false;
}

SkeletonTake read_any(const std::string& path, const TakeOptions& options) {
  if (is_gltf_name(path)) return of_gltf(path, options.motion, options.clip);
  if (is_motions_name(path)) return of_motions(path, options);
  if (!options.clip.empty())
    throw InputError(path, "is one recording, of which no clip can be chosen", "leave {clip} out");
  if (is_estimated(path, options.motion.layout)) return of_parameters(path, options);
  if (const auto joints =
          find_joint_recording(path, joint_options(options.motion.layout, options.person)))
    return of_joints(*joints, path, options.motion);
  return is_recording(path) ? of_recording(path, options) : of_parameters(path, options);
}

}  // namespace

SkeletonTake read_take(const std::string& path, const TakeOptions& options) {
  SkeletonTake out = read_any(path, options);
  if (!fingers_move(out)) out.fingers.clear();
  return out;
}

void put_on_floor(SkeletonTake& take, const Joints& rest) {
  constexpr double kSeen = 0.03;  // metres
  if (take.own_floor || take.frames.empty()) return;
  std::vector<double> lowest;
  for (size_t f = 0; f < take.frames.size(); ++f)
    lowest.push_back(lowest_foot(forward_kinematics(rest, perform_take(take, f, rest))));
  const double off = floor_height(std::move(lowest)) - lowest_foot_of(rest);
  if (std::abs(off) < kSeen) return;
  const double scale = leg_length(rest) / std::max(leg_length(take.rest), 1e-9);
  for (Vec3& x : take.rest) x.y() += off / std::max(scale, 1e-9);
}

Pose perform_take(const SkeletonTake& take, size_t frame, const Joints& rest) {
  const PosedSkeleton& source = take.frames.at(frame);
  const Joints& theirs = take.rest;
  Rotations global = source.global;
  for (const Limb& limb : t_pose_limbs())
    global[limb.from] *=
        shortest_arc(rest[limb.to] - rest[limb.from], theirs[limb.to] - theirs[limb.from]);
  const auto hips = [](const Joints& x) { return Vec3(0.5 * (x[kLeftHip] + x[kRightHip])); };
  const double scale = leg_length(rest) / std::max(leg_length(theirs), 1e-9);
  Vec3 place = scale * hips(source.joints);
  place.y() += hips(rest).y() - scale * hips(theirs).y();
  return {to_local(global), place + global[kPelvis] * (rest[kPelvis] - hips(rest))};
}

}  // namespace restage
