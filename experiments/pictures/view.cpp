#include "experiments/pictures/view.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "datasets/characters/mesh_document.h"
#include "datasets/importers/motions/skeleton_take.h"
#include "datasets/importers/rigs/gltf_rig.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"
#include "nn/geometry/box.h"

namespace restage {
namespace {

constexpr int64_t kMostFrames = 36'000;  // twenty minutes at 30 frames per second

/// Which frames of `total` are shown, of a file at `rate` frames per second.
std::vector<int64_t> chosen(const ShowRequest& request, int64_t total, double rate) {
  const std::string& path = request.path;
  if (request.single) {
    const double last = static_cast<double>(total - 1);
    if (request.frame && !(*request.frame >= 0 && *request.frame < total))
      throw InputError(path, format("has no frame %lld", static_cast<long long>(*request.frame)),
                       format("give --frame 0 to %lld", static_cast<long long>(total - 1)));
    if (request.seconds && !(*request.seconds >= 0 && *request.seconds * rate <= last + 0.5))
      throw InputError(path, format("has nothing at %g seconds", *request.seconds),
                       format("give --time 0 to %.3g", last / rate));
    if (request.frame) return {*request.frame};
    if (request.seconds)
      return {std::min<int64_t>(std::llround(*request.seconds * rate), total - 1)};
    return {total / 2};
  }
  std::vector<int64_t> out;
  for (int64_t f = 0; f < total; f += request.every) out.push_back(f);
  if (std::ssize(out) > kMostFrames)
    throw InputError(path, format("has %lld frames", static_cast<long long>(total)),
                     "show one in many: --every 10");
  return out;
}

void look_at(Showing& view, const std::vector<Joints>& joints, const ShowRequest& request) {
  if (request.single && joints.size() == 1) view.facing = facing(joints[0]);
  if (request.look.part.empty()) return;
  if (joints.size() != view.clip.frames.size())
    throw InputError(request.path, "does not say where to look for " + request.look.part,
                     "leave the close-up out, or say which bone is which (docs/formats.md)");
  Aim aim = aim_at(joints, request.look, view.clip);
  view.clip.focus = std::move(aim.focus);
  view.close_up = aim.close_up;
}

/// What is no person's size is drawn at a person's: light, ground and camera are made for that.
void fit(Showing& view, std::vector<Joints>& joints) {
  Box box;
  for (const Point& p : std::as_const(view.clip).frames[0])
    if (p.allFinite()) box.extend(p);
  const float size = box.isEmpty() ? 1 : box.sizes().maxCoeff();
  if (size > 0.25f && size < 8) return;
  const float factor = size > 0 ? 1.7f / size : 1;
  for (size_t f = 0; f < view.clip.frames.size(); ++f)
    for (Point& p : view.clip.frames[f]) p *= factor;
  for (Joints& frame : joints)
    for (Vec3& joint : frame) joint *= double{factor};
  view.remarks.push_back(
      format("it is %.3g units large, and drawn as large as a person", static_cast<double>(size)));
}

// ---- glTF
// ----------------------------------------------------------------------------------------

const GltfClip* clip_of(const GltfLook& look, const std::string& name) {
  if (!name.empty()) return &find_clip(look.file, name);
  for (size_t c = look.file.clips.size(); c-- > 0;)
    if (look.ours[c]) return &look.file.clips[c];
  return look.file.clips.empty() ? nullptr : &look.file.clips[0];
}

/// The rig, if it is a person's that is known here.
std::optional<GltfRig> rig_of(const Gltf& file, const std::string& bones) {
  MotionOptions options;
  options.force = true;
  options.profile = bones;
  ImportReport ignored;
  try {
    return find_rig(file, options, ignored);
  } catch (const InputError&) {
    if (!bones.empty()) throw;
    return std::nullopt;
  }
}

/// Lines between nodes that move, and what hangs on them; without these, between all nodes.
std::vector<int> bones_of(const Gltf& file) {
  std::vector<bool> moves(file.nodes.size());
  for (const GltfClip& clip : file.clips)
    for (const GltfTrack& track : clip.tracks) moves[static_cast<size_t>(track.node)] = true;
  for (const GltfBone& bone : file.bones) moves[static_cast<size_t>(bone.node)] = true;
  std::vector<int> out;
  for (size_t n = 0; n < moves.size(); ++n) {
    const int parent = file.nodes[n].parent;
    const bool hangs = parent >= 0 && moves[static_cast<size_t>(parent)];
    moves[n] = moves[n] || hangs;
    out.push_back(hangs ? parent : -1);
  }
  if (std::all_of(out.begin(), out.end(), [](int parent) { return parent < 0; }))
    for (size_t n = 0; n < out.size(); ++n) out[n] = file.nodes[n].parent;
  return out;
}

/// A document, or a mesh of another kind as one (dressed()).
Showing view_gltf(const ShowRequest& request, GltfLook look) {
  const Gltf& file = look.file;
  const GltfClip* clip = clip_of(look, request.clip);
  const std::vector<int> bones = bones_of(file);
  const bool sticks = file.vertices.empty();
  if (sticks && std::all_of(bones.begin(), bones.end(), [](int parent) { return parent < 0; }))
    throw InputError(request.path, "holds neither a mesh nor bones: there is nothing to draw",
                     "export the character with its mesh");
  const std::optional<GltfRig> rig = rig_of(file, request.bones);
  Showing view;
  view.clip.fps = request.fps.value_or(kFps);
  int64_t total = 1;
  if (clip != nullptr) {
    view.animation = clip->name;
    clip_frames(file, *clip);  // refuses what lasts for days
    total = static_cast<int64_t>(std::floor((clip->end - clip->begin) * view.clip.fps + 1e-3)) + 1;
  }
  std::vector<Joints> joints;
  for (const int64_t f : chosen(request, total, view.clip.fps)) {
    const double seconds = clip ? clip->begin + static_cast<double>(f) / view.clip.fps : 0;
    const GltfTransforms nodes = clip ? gltf_pose(file, *clip, seconds) : gltf_rest(file);
    Mesh mesh;
    if (!sticks) {
      mesh = gltf_look_mesh(look, nodes, clip, seconds);
    } else {
      for (const Eigen::Affine3d& node : nodes)
        mesh.vertices.push_back(node.translation().cast<float>());
      mesh.vertices = stick_figure(mesh.vertices, bones);
    }
    if (rig)
      for (Point& p : mesh.vertices) p = rig->to_ours(p.cast<double>()).cast<float>();
    if (rig) joints.push_back(rig_pose(*rig, nodes).joints);
    if (view.clip.frames.empty()) view.clip.faces = mesh.faces;
    view.clip.frames.push_back(std::move(mesh.vertices));
  }
  view.clip.fps /= static_cast<double>(request.every);
  if (!view.clip.faces.empty()) view.clip.look = appearance_of(look);
  view.remarks = file.remarks;
  fit(view, joints);
  look_at(view, joints, request);
  return view;
}

// ---- everything else
// -----------------------------------------------------------------------------

Showing view_take(const ShowRequest& request, std::vector<Joints>& joints) {
  TakeOptions options;
  options.motion.force = true;
  options.motion.profile = request.bones;
  if (request.scale) options.motion.scale = *request.scale;
  if (!request.up.empty()) options.motion.rest.up = parse_axis(request.up, "--up");
  options.clip = request.clip;
  options.sequence = request.sequence;
  const SkeletonTake take = [&] {
    try {
      return read_take(request.path, options);
    } catch (const InputError&) {  // --fps also says the rate of a file that states none
      if (!request.fps) throw;
      options.motion.fps = *request.fps;
      return read_take(request.path, options);
    }
  }();
  Showing view;
  view.animation = take.name;
  for (const PosedSkeleton& frame : take.frames) {
    view.clip.frames.push_back(stick_figure(frame.joints));
    joints.push_back(frame.joints);
  }
  return view;
}

Showing view_frames(const ShowRequest& request, std::vector<Joints>& joints) {
  if (!request.clip.empty())
    throw InputError(request.path, "has no clips by name", "leave --clip out");
  Showing view;
  view.clip = read_clip({.path = request.path,
                         .sequence = request.sequence,
                         .fps = request.file_fps,
                         .scale = request.scale.value_or(1),
                         .up = request.up.empty() ? "y" : request.up},
                        "", request.max_memory, view.remarks);
  if (!has_joints(request.path)) return view;
  joints = read_joints(request.path, request.sequence);
  joints.resize(view.clip.frames.size(), joints.back());
  return view;
}

Showing view_others(const ShowRequest& request) {
  std::vector<Joints> joints, kept;
  Showing view = holds_take(request.path, request.bones) ? view_take(request, joints)
                                                         : view_frames(request, joints);
  Clip& all = view.clip;
  const double rate = request.fps.value_or(all.fps);
  const auto total = static_cast<int64_t>(std::floor(
                         static_cast<double>(all.frames.size() - 1) * rate / all.fps + 1e-6)) +
                     1;
  FrameStore<Point> frames;
  for (const int64_t f : chosen(request, total, rate)) {
    const auto nearest =
        std::min<size_t>(static_cast<size_t>(std::llround(static_cast<double>(f) * all.fps / rate)),
                         all.frames.size() - 1);
    frames.push_back(std::as_const(all).frames[nearest]);
    if (!joints.empty()) kept.push_back(joints[nearest]);
  }
  all.frames = std::move(frames);
  all.confidence.clear();
  all.fps = rate / static_cast<double>(request.every);
  fit(view, kept);
  look_at(view, kept, request);
  return view;
}

}  // namespace

namespace {

/// An OBJ or PLY file with pictures or colours, as a document; nothing: it has none, or is to be
/// turned or scaled.
std::optional<GltfLook> dressed(const ShowRequest& request, std::vector<std::string>& remarks) {
  if (!text::ends_in(request.path, {".obj", ".ply"})) return std::nullopt;
  if (!request.up.empty() || request.scale || !request.clip.empty()) return std::nullopt;
  const std::optional<MeshDocument> made =
      mesh_document(request.path, read_mesh(request.path).vertices.size());
  if (!made) return std::nullopt;
  for (const std::string& remark : made->remarks)
    remarks.push_back(cat(request.path, ": ", remark));
  return parse_gltf_look(made->glb, request.path);
}

}  // namespace

std::shared_ptr<const Appearance> appearance_of(GltfLook& look) {
  if (look.look.materials.size() < 2 && look.look.colours.empty()) return nullptr;
  return std::make_shared<const Appearance>(std::move(look.look));
}

Showing read_showing(const ShowRequest& request) {
  const auto refuse_if = [&](bool given, const char* option, const char* what) {
    if (given)
      throw InputError(request.path, cat(what, ", which ", option, " cannot change"),
                       cat("leave ", option, " out"));
  };
  const bool glTF = is_gltf_name(request.path);
  refuse_if(glTF && !request.up.empty(), "--up", "says where up is");
  refuse_if(glTF && request.scale.has_value(), "--scale", "says how large it is");
  refuse_if(request.sequence && !text::ends_in(request.path, {".h5", ".hdf5"}), "--sequence",
            "holds one sequence");
  if (glTF) return view_gltf(request, read_gltf_look(request.path));
  std::vector<std::string> remarks;
  std::optional<GltfLook> look = dressed(request, remarks);
  if (!look) return view_others(request);
  Showing out = view_gltf(request, std::move(*look));
  out.remarks.insert(out.remarks.end(), remarks.begin(), remarks.end());
  return out;
}

}  // namespace restage
