#include "experiments/cli/retarget_sink.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include "autograd/base/format.h"
#include "autograd/base/log.h"
#include "datasets/characters/gltf_clip.h"
#include "datasets/characters/mesh_template.h"
#include "datasets/readers/text.h"
#include "infer/writers/bvh.h"
#include "infer/writers/frames.h"
#include "infer/writers/glb.h"

namespace restage::cli {
namespace {

using Frames = std::vector<int64_t>;

bool is_character(const std::string& out) { return text::ends_in(out, {".glb", ".gltf", ".vrm"}); }

/// What the skeleton's files are made of.
const SystemRig& rig_of(const Shown& shown, const std::string& out) {
  if (shown.rig == nullptr)
    throw InputError(out, "needs a skeleton, which this system does not have",
                     "end it in .h5, or / for a folder of frames");
  return *shown.rig;
}

Sink own_sink(const SinkOptions& options, const std::string& clip, const std::string& target,
              const std::shared_ptr<const GltfOwnRig>& own) {
  if (text::ends_in(options.out, {".vrm"}) && own->file().humanoid.empty())
    throw InputError(options.out, "would be no VRM character, since the target is none",
                     "end --out in .glb");
  const auto writer = std::make_shared<GltfClipWriter>(
      options.out, target, own,
      GltfClipWriter::Options{options.clip_name.empty() ? clip : options.clip_name, options.rate(),
                              options.animation_only});
  return {[writer](const RetargetedFrame& f) { writer->push(f.pose, f.confidence); },
          [writer](const Frames& filled) {
            writer->set_filled(filled);
            writer->commit();
          }};
}

/// The target has no bones that we know: a skeleton and a skin of our own.
Sink glb_sink(const SinkOptions& options, const Shown& shown) {
  if (!text::ends_in(options.out, {".glb"}))
    throw InputError(options.out, "keeps the target's own file, which has no rig that we know",
                     "end --out in .glb, or name its bones with --bones");
  if (options.animation_only || !options.clip_name.empty())
    throw InputError(options.out, "has no rig of its own whose animation could be named or alone",
                     "leave --clip-name and --animation-only out");
  const SystemRig& rig = rig_of(shown, options.out);
  const auto writer = std::make_shared<GlbWriter>(options.out, shown.target, rig.rest, rig.weights);
  const auto commit = [writer](const Frames& filled) {
    writer->set_filled(filled);
    const InfluenceError e = writer->commit();
    log_info(format("four weights per vertex instead of 22: %.2f mm on average, at most %.2f mm",
                    1e3 * e.mean, 1e3 * e.max));
  };
  return {[writer](const RetargetedFrame& f) { writer->push(f.pose, f.confidence); }, commit};
}

/// What a character's own bones are called; of joints without a bone: nothing. BVH ends names at
/// blanks, so those become '_'.
std::array<std::string, kJoints> bone_names(const GltfOwnRig& own) {
  std::array<std::string, kJoints> out;
  std::set<std::string> taken;
  for (size_t j = 0; j < kJoints; ++j) {
    const int node = j == kPelvis ? own.rig().hips : own.rig().node[j];
    if (j != kPelvis && !own.rig().offset[j].isZero()) continue;
    std::string name = own.file().nodes[static_cast<size_t>(node)].name;
    std::replace_if(
        name.begin(), name.end(),
        [](char c) { return c == ' ' || (c >= 0 && c < ' ') || c == '{' || c == '}'; }, '_');
    if (taken.insert(name).second) out[j] = name;
  }
  return out;
}

Sink bvh_sink(const SinkOptions& options, const Shown& shown,
              const std::shared_ptr<const GltfOwnRig>& own) {
  BvhWriterOptions how;
  if (own) how.names = bone_names(*own);
  const auto writer =
      std::make_shared<BvhWriter>(options.out, rig_of(shown, options.out).rest, how);
  return {[writer](const RetargetedFrame& f) { writer->push(f.pose); },
          [writer](const Frames&) { writer->commit(); }};
}

Sink hdf5_sink(const SinkOptions& options, const Shown& shown,
               const std::optional<SourceRecord>& source) {
  rig_of(shown, options.out);  // /joints must be there
  const Mesh& target = shown.target;
  const auto writer = std::make_shared<PredictionWriter>(options.out, std::ssize(target.vertices),
                                                         target.faces, FileInfo{}, options.rate());
  if (source) writer->set_source(*source);
  return {[writer](const RetargetedFrame& f) {
            writer->append(f.joints.value(), f.vertices, f.confidence);
            writer->append_rotations(to_global(f.pose.local));
          },
          [writer](const Frames& filled) {
            writer->set_filled(filled);
            writer->commit();
          }};
}

/// Frames in the target's own file, where the format is the target's.
Sink folder_sink(const SinkOptions& options, const Shown& shown, const std::string& target) {
  const std::string own = text::ends_in(target, {".obj"}) ? "obj" : "ply";
  const std::string& format = options.format.empty() ? own : options.format;
  const MeshFormat kind = format == "obj" ? MeshFormat::obj : MeshFormat::ply;
  std::shared_ptr<const MeshTemplate> mesh = MeshTemplate::of(target, shown.target.vertices.size());
  std::shared_ptr<FrameFolderWriter> writer;
  if (mesh && mesh->format() == kind)
    writer = std::make_shared<FrameFolderWriter>(
        options.out, kind, [mesh, folder = options.out](const Points& vertices) {
          return mesh->with(vertices, folder);
        });
  else
    writer = std::make_shared<FrameFolderWriter>(options.out, shown.target.faces, kind);
  return {[writer](const RetargetedFrame& f) { writer->push(f.vertices); },
          [writer, mesh, kind](const Frames&) {
            writer->commit();
            if (mesh && mesh->format() == kind && mesh->had_normals())
              log_info("frames have no normals: the target's are those of its rest pose");
          }};
}

}  // namespace

void check_sink(const SinkOptions& options) {
  const std::string& out = options.out;
  if (!options.format.empty() && options.format != "ply" && options.format != "obj")
    throw InputError("", "--format '" + options.format + "' is unknown", "use ply or obj");
  if (options.every < 1 || options.every > 1000000)
    throw InputError("", "--every is out of range", "give 1 or more frames");
  if (options.every > 1 && !out.ends_with(".h5"))
    throw InputError(out, "is played at 30 frames a second", "end --out in .h5 with --every");
  if (text::ends_in(out, {".fbx"})) {
    const std::string glb = std::filesystem::path(out).stem().string() + ".glb";
    throw InputError(out, "is FBX, which Blender writes",
                     "end --out in .glb; then: blender -b --python docs/glb_to_fbx.py -- " + glb +
                         " " + std::filesystem::path(out).filename().string());
  }
  const auto dot = out.find_last_of('.');
  const auto slash = out.find_last_of('/');
  const bool extension = dot != std::string::npos && (slash == std::string::npos || dot > slash) &&
                         dot + 1 < out.size();
  if (extension && !is_character(out) && !out.ends_with(".bvh") && !out.ends_with(".h5"))
    throw InputError(out, "is of no kind that can be written",
                     "end it in .glb, .gltf, .vrm, .bvh, .h5, or / for a folder");
  if ((options.animation_only || !options.clip_name.empty()) && !is_character(out))
    throw InputError(out, "holds no animation that could be named or alone",
                     "leave --clip-name and --animation-only out, or end --out in .glb");
}

std::string clip_name(const SourceRecord& source) {
  if (!source.clip.empty()) return source.clip;
  std::filesystem::path path(source.path);
  if (!path.has_filename()) path = path.parent_path();  // "scans/"
  const std::string stem = path.stem().string();
  return text::is_utf8(stem) && !stem.empty() && stem != "." && stem != ".." ? stem : "retargeted";
}

Sink make_sink(const SinkOptions& options, const Shown& shown,
               const std::optional<SourceRecord>& source, const std::string& clip,
               const std::string& target, const std::shared_ptr<const GltfOwnRig>& own) {
  if (is_character(options.out))
    return own ? own_sink(options, clip, target, own) : glb_sink(options, shown);
  if (options.out.ends_with(".bvh")) return bvh_sink(options, shown, own);
  if (options.out.ends_with(".h5")) return hdf5_sink(options, shown, source);
  return folder_sink(options, shown, target);
}

}  // namespace restage::cli
