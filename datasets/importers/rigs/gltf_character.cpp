#include "datasets/importers/rigs/gltf_character.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include "autograd/base/format.h"
#include "datasets/importers/rigs/joint_fit.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"

namespace restage {
namespace {

std::string id_of(const std::string& path, const MotionOptions& options) {
  return options.id.empty() ? std::filesystem::path(path).stem().string() : options.id;
}

void describe(const Gltf& file, ImportReport& report) {
  report.file = file.path;
  const size_t joints = skin_joints(file);
  report.fact("holds", cat(file.standard, file.standard.empty() ? "" : ", ",
                           counted(file.meshes, "mesh", "meshes"), " of ", file.vertices.size(),
                           " vertices and ", file.faces.size(), " triangles, ",
                           counted(file.morph_targets, "morph target"), ", ",
                           counted(file.skin_nodes.size(), "skin"), " with ", joints, " joints, ",
                           counted(file.clips.size(), "animation")));
  report.remarks.insert(report.remarks.end(), file.remarks.begin(), file.remarks.end());
}

// ---- body --------------------------------------------------------------------------------------

Mesh t_pose_mesh(const Gltf& file, const GltfRig& rig) {
  Mesh out = gltf_mesh(file, rig.t_pose);
  for (Point& p : out.vertices) p = rig.to_ours(p.cast<double>()).cast<float>();
  return out;
}

Body body_of(const Gltf& file, const GltfRig& rig) {
  Body body;
  body.rest = t_pose_mesh(file, rig);
  body.joints = t_pose_joints(rig);
  const Vec3 origin = put_on_floor(body.rest, body.joints[0]);
  for (Vec3& x : body.joints) x -= origin;
  body.weights = joint_weights(file, rig);
  return body;
}

// ---- motions -----------------------------------------------------------------------------------

std::string rate_of(const Gltf& file, const GltfClip& clip, int64_t frames) {
  size_t most = 0;
  for (const GltfTrack& track : clip.tracks) most = std::max(most, file.times[track.times].size());
  const double seconds = clip.end - clip.begin;
  return format("%.2f s, up to %zu keys a joint (%.4g a second), sampled to %lld frames at 30 fps",
                seconds, most, seconds > 0 ? static_cast<double>(most - 1) / seconds : 0.0,
                static_cast<long long>(frames));
}

Motion motion_of(const Gltf& file, const GltfRig& rig, const GltfClip& clip, int64_t frames,
                 ImportReport& report) {
  Motion motion;
  motion.rest = t_pose_joints(rig);
  const Vec3 pelvis = motion.rest[0];
  for (Vec3& x : motion.rest) x -= pelvis;
  std::vector<double> lowest;
  for (const PosedSkeleton& pose : clip_poses(file, rig, clip, frames, report)) {
    auto& global = motion.global.emplace_back();
    for (size_t j = 0; j < kJoints; ++j)
      global[j] = Quat(pose.global[j]).normalized().cast<float>();
    motion.hips.push_back((0.5 * (pose.joints[1] + pose.joints[2])).cast<float>());
    lowest.push_back(lowest_foot(pose));
  }
  const auto floor = static_cast<float>(floor_height(std::move(lowest)));
  for (Point& p : motion.hips) p.y() -= floor;
  return motion;
}

std::vector<Motion> motions_of(const Gltf& file, const GltfRig& rig, const MotionOptions& options,
                               const std::string& only, ImportReport& report) {
  std::vector<const GltfClip*> clips;
  if (!only.empty())
    clips.push_back(&find_clip(file, only));
  else
    for (const GltfClip& clip : file.clips) clips.push_back(&clip);
  std::vector<Motion> out;
  std::set<std::string> ids;
  int64_t left = 100000 + static_cast<int64_t>(file.bytes / 50);  // bounds what a small file makes
  for (const GltfClip* clip : clips) {
    if (!moves_joints(file, rig, *clip)) {
      report.remark("clip " + text::quote(clip->name) + " moves none of the joints");
      continue;
    }
    const int64_t frames = clip_frames(file, *clip);
    left -= frames;
    if (left < 0)
      throw InputError(file.path, "its animations are far longer than the keys in it",
                       "import them one by one ({clip}), or cut them");
    Motion motion = motion_of(file, rig, *clip, frames, report);
    std::string id = id_of(file.path, options);
    if (clips.size() > 1 || !only.empty()) id += "_" + clip->name;
    std::replace(id.begin(), id.end(), '/', '_');
    motion.id = id;
    for (int again = 2; !ids.insert(motion.id).second; ++again) motion.id = cat(id, "_", again);
    motion.subject = options.subject.empty() ? id_of(file.path, options) : options.subject;
    motion.split = options.split;
    motion.action = options.action.empty() ? clip->name : options.action;
    report.fact("clip " + text::quote(clip->name), rate_of(file, *clip, frames));
    out.push_back(std::move(motion));
  }
  return out;
}

[[noreturn]] void throw_no_skin(const std::string& path) {
  throw InputError(path, "has no skin: no bone moves its mesh",
                   "bind the mesh to the rig (in Blender: Set Parent To, Armature Deform) and "
                   "export again; as a rigid {target} it will do");
}

/// Nodes whose meshes move with them as they are, without a skin.
std::vector<int> rigid_parts(const Gltf& file) {
  std::set<int> out;
  for (const GltfInfluence& by : file.influences)
    if (const GltfBone& bone = file.bones[by.bone]; bone.skin < 0) out.insert(bone.node);
  return {out.begin(), out.end()};
}

/// Whether the parts are a body's: they hang on six of the 22 joints or more. Bones beside a mesh
/// that hangs on none of them move nothing.
bool moves_as_parts(const Gltf& file, const GltfRig& rig, const std::vector<int>& parts) {
  constexpr size_t kFewest = 6;
  std::set<int> joints;
  for (const int n : parts)
    for (int b = n; b >= 0; b = file.nodes[static_cast<size_t>(b)].parent)
      if (b == rig.hips || std::find(rig.node.begin(), rig.node.end(), b) != rig.node.end()) {
        joints.insert(rig.joint[static_cast<size_t>(n)]);
        break;
      }
  return joints.size() >= kFewest;
}

std::string words_of(const Gltf& file, const std::vector<int>& parts) {
  constexpr size_t kLongList = 80;  // bytes
  std::vector<std::string> names;
  for (const int n : parts) names.push_back(text::quote(file.nodes[static_cast<size_t>(n)].name));
  return cat(parts.size(), " rigid parts (", cut_list(names, kLongList), ")");
}

}  // namespace

size_t skin_joints(const Gltf& file) {
  std::set<int> out;
  for (const GltfBone& bone : file.bones)
    if (bone.skin >= 0) out.insert(bone.node);
  return out.size();
}

bool moves_joints(const Gltf& file, const GltfRig& rig, const GltfClip& clip) {
  std::vector<bool> counts(file.nodes.size());
  for (int n : rig.node)
    for (; n >= 0 && !counts[n]; n = file.nodes[n].parent) counts[n] = true;
  return std::any_of(clip.tracks.begin(), clip.tracks.end(),
                     [&](const GltfTrack& track) { return counts[track.node]; });
}

namespace {

/// Whether a joint goes anywhere in it, or turns: exporters leave still clips called "Take 001".
bool goes_on(const Gltf& file, const GltfRig& rig, const GltfClip& clip) {
  constexpr double kStill = 1e-3;  // radians, and shares of the leg
  constexpr int64_t kLooks = 24;
  const int64_t frames = clip_frames(file, clip);
  std::optional<PosedSkeleton> first;
  const double leg = std::max(leg_length(t_pose_joints(rig)), 1e-9);
  for (int64_t look = 0; look < std::min(kLooks, frames); ++look) {
    const int64_t f = look * (frames - 1) / std::max<int64_t>(1, std::min(kLooks, frames) - 1);
    const PosedSkeleton pose =
        rig_pose(rig, gltf_pose(file, clip, clip.begin + static_cast<double>(f) / kFps));
    if (!first) first = pose;
    for (size_t j = 0; j < kJoints; ++j) {
      const bool moved = (pose.joints[j] - first->joints[j]).norm() > kStill * leg;
      if (moved || (pose.global[j] - first->global[j]).norm() > kStill) return true;
    }
  }
  return false;
}

}  // namespace

const GltfClip& first_clip(const Gltf& file, const GltfRig& rig) {
  const GltfClip* still = nullptr;
  for (const GltfClip& clip : file.clips) {
    if (!moves_joints(file, rig, clip)) continue;
    if (goes_on(file, rig, clip)) return clip;
    if (still == nullptr) still = &clip;
  }
  if (still != nullptr) return *still;
  throw InputError(file.path, "holds no animation that moves its bones",
                   "export it with its animation");
}

std::vector<PosedSkeleton> clip_poses(const Gltf& file, const GltfRig& rig, const GltfClip& clip,
                                      int64_t frames, ImportReport& report) {
  std::vector<PosedSkeleton> out;
  JointFit fit(t_pose_joints(rig));
  for (int64_t f = 0; f < frames; ++f) {
    const double seconds = clip.begin + static_cast<double>(f) / kFps;
    PosedSkeleton pose = rig_pose(rig, gltf_pose(file, clip, seconds));
    for (size_t j = 0; j < kJoints; ++j)
      if (!pose.joints[j].allFinite() || !pose.global[j].allFinite())
        throw InputError(file.path,
                         cat("frame ", f, " of ", text::quote(clip.name), " puts a joint nowhere"),
                         "export it again with finite scales");
    fit.turn(pose);
    out.push_back(pose);
  }
  fit.report(report);
  return out;
}

Character read_character(const std::string& path, const MotionOptions& options,
                         const std::string& clip) {
  const Gltf file = read_gltf(path);
  Character out;
  describe(file, out.report);
  const bool skinned =
      std::any_of(file.influences.begin(), file.influences.end(),
                  [&](const GltfInfluence& by) { return file.bones[by.bone].skin >= 0; });
  const bool loose = !skinned && !file.vertices.empty();
  if (loose && file.clips.empty()) throw_no_skin(path);
  const GltfRig rig = find_rig(file, options, out.report);
  check_handedness(t_pose_joints(rig), options.force, out.report);
  if (loose) out.report.remark("left out its mesh, which belongs to no skin");
  if (file.morph_targets > 0)
    out.report.remark("morph targets are left out: the face rests as it is modelled");
  if (skinned) {
    out.body = body_of(file, rig);
    out.body->id = id_of(path, options);
    out.body->split = options.split;
  }
  out.motions = motions_of(file, rig, options, clip, out.report);
  if (loose && out.motions.empty()) throw_no_skin(path);
  if (!out.body && out.motions.empty())
    throw InputError(path, "holds neither a mesh nor an animation of a person",
                     "export the character with its mesh or its animation");
  return out;
}

ExamineOptions TargetMesh::known() const {
  ExamineOptions out;
  out.joints = joints;
  out.y_up = rigged;
  return out;
}

TargetMesh read_target(const std::string& path, const std::string& bones) {
  TargetMesh out;
  Gltf file;
  if (is_gltf_name(path)) {
    file = read_gltf(path);
    describe(file, out.report);
  }
  const std::vector<int> parts = rigid_parts(file);
  if (file.skin_nodes.empty() && parts.size() < 2 && !bones.empty())
    throw InputError(path, "has no rig whose bones could be named", "leave {bones} out");
  if (!is_gltf_name(path)) {
    out.mesh = read_mesh(path);
    return out;
  }
  out.rigged = !file.skin_nodes.empty();
  MotionOptions options;
  options.profile = bones;
  GltfRig rig;
  if (out.rigged) {
    try {
      rig = find_rig(file, options, out.report);
    } catch (const UnknownSkeleton& error) {
      out.unknown_rig = error.reason;
    }
  } else if (parts.size() > 1) {
    try {
      ImportReport of_parts = out.report;
      rig = find_rig(file, options, of_parts);
      out.rigged = moves_as_parts(file, rig, parts);
      if (out.rigged) out.report = std::move(of_parts);
    } catch (const InputError& error) {  // a mesh in parts, then
      if (!bones.empty()) throw;
      out.parts = words_of(file, parts);
      out.unknown_parts = error.cause();
    }
  }
  if (!out.rigged || !out.unknown_rig.empty()) {
    out.report.remark(!out.rigged
                          ? "has no rig: its mesh is taken as it stands"
                          : "its rig was not recognised, so its mesh is taken as it stands (name "
                            "its bones with {bones}): " +
                                out.unknown_rig);
    out.mesh = gltf_mesh(file, gltf_rest(file));
    return out;
  }
  check_handedness(t_pose_joints(rig), true, out.report);
  out.own = std::make_shared<GltfOwnRig>(std::move(file), std::move(rig));
  out.mesh = out.own->mesh();
  out.joints = out.own->rest();
  return out;
}

}  // namespace restage
