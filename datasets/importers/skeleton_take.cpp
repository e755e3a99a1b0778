#include "datasets/importers/skeleton_take.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "autograd/base/format.h"
#include "datasets/importers/amc.h"
#include "datasets/importers/bvh.h"
#include "datasets/importers/gltf_character.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text.h"

namespace restage {
namespace {

bool is_recording(const std::string& path) {
  return text::ends_in(path, {".bvh", ".bvh.xz", ".amc", ".amc.xz"});
}

double lowest_foot_of(const Joints& joints) {
  return std::min({joints[7].y(), joints[8].y(), joints[10].y(), joints[11].y()});
}

/// Puts the rest pose upright over the place where frames have their floor: its feet stand on it.
void stand_on_floor(SkeletonTake& p) {
  std::vector<double> lowest;
  for (const PosedSkeleton& frame : p.frames) lowest.push_back(lowest_foot(frame));
  const double lift = floor_height(std::move(lowest)) - lowest_foot_of(p.rest);
  for (Vec3& x : p.rest) x.y() += lift;
}

SkeletonTake of_recording(const std::string& path, const MotionOptions& options) {
  const bool amc = text::ends_in(path, {".amc", ".amc.xz"});
  MotionClip clip = amc ? read_amc(path, "", options) : read_bvh(path, options);
  SkeletonTake out;
  out.name = stem_of(path);
  out.rest = clip.motion.rest;
  out.report = std::move(clip.report);
  out.frames.resize(clip.joints.size());
  for (size_t f = 0; f < out.frames.size(); ++f) {
    out.frames[f].joints = clip.joints[f];
    for (size_t j = 0; j < kJoints; ++j)
      out.frames[f].global[j] = clip.motion.global[f][j].cast<double>().toRotationMatrix();
  }
  stand_on_floor(out);
  return out;
}

SkeletonTake of_gltf(const std::string& path, const MotionOptions& options,
                     const std::string& name) {
  const Gltf file = read_gltf(path);
  SkeletonTake out;
  out.report.file = path;
  const GltfRig rig = find_rig(file, options, out.report);
  // A body stands on its soles, wherever its file lets it rest; bare bones, where they rest.
  out.rest = file.vertices.empty() ? t_pose_joints(rig) : GltfOwnRig(file, rig).rest();
  check_handedness(out.rest, options.force, out.report);
  const GltfClip& clip = name.empty() ? first_clip(file, rig) : find_clip(file, name);
  out.name = clip.name;
  out.frames = clip_poses(file, rig, clip, clip_frames(file, clip), out.report);
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

bool holds_take(const std::string& path, const std::string& bones, std::string* why) {
  if (is_recording(path)) return true;
  std::error_code error;
  if (!is_gltf_name(path) || std::filesystem::is_directory(path, error)) return false;
  const Gltf file = read_gltf(path);
  if (file.clips.empty()) return false;
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

SkeletonTake read_take(const std::string& path, const MotionOptions& options,
                       const std::string& clip) {
  if (!is_recording(path)) return of_gltf(path, options, clip);
  if (!clip.empty())
    throw InputError(path, "is one recording, of which no clip can be chosen", "leave --clip out");
  return of_recording(path, options);
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
