#include "experiments/cli/perform/retarget_sink.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include "autograd/base/format.h"
#include "autograd/base/log.h"
#include "datasets/characters/gltf_clip.h"
#include "datasets/characters/mesh_template.h"
#include "datasets/frame_writer.h"
#include "datasets/readers/text/text.h"
#include "experiments/cli/perform/bare_document.h"
#include "infer/frame_rate.h"
#include "infer/writers/bvh.h"
#include "infer/writers/glb.h"
#include "infer/writers/vrma.h"

namespace restage::cli {
namespace {

using Frames = std::vector<int64_t>;

bool is_character(const std::string& out) { return text::ends_in(out, {".glb", ".gltf", ".vrm"}); }

bool is_vrma(const std::string& out) { return text::ends_in(out, {".vrma"}); }

bool is_animation(const std::string& out) {
  return is_character(out) || is_vrma(out) || out.ends_with(".bvh");
}

/// What the skeleton's files are made of.
const SystemRig& rig_of(const Shown& shown, const std::string& out) {
  if (shown.rig == nullptr)
    throw InputError(out, "needs a skeleton, which this system does not have",
                     "end it in / for a folder of frames");
  return *shown.rig;
}

}  // namespace

std::string own_clip_name(const SinkOptions& options, const std::string& clip,
                          const std::string& target, const GltfOwnRig& own) {
  std::string name = options.clip_name.empty() ? clip : options.clip_name;
  const auto is_taken = [&](const std::string& other) {
    const auto& all = own.file().clips;
    return !options.animation_only &&
           std::any_of(all.begin(), all.end(), [&](const GltfClip& c) { return c.name == other; });
  };
  if (is_taken(name) && !options.clip_name.empty())
    throw InputError(target, "has an animation " + text::quote(name) + " already",
                     "give another --clip-name");
  if (is_taken(name)) {
    int number = 2;
    while (is_taken(name + " " + std::to_string(number))) ++number;
    name += " " + std::to_string(number);
  }
  return name;
}

namespace {

Sink own_sink(const SinkOptions& options, const std::string& clip, const std::string& target,
              const std::shared_ptr<const GltfOwnRig>& own) {
  if (text::ends_in(options.out, {".vrm"}) && own->file().humanoid.empty())
    throw InputError(options.out, "would be no VRM character, since the target is none",
                     "end --out in .glb");
  if (text::ends_in(options.out, {".vrm"}) && options.animation_only)
    throw InputError(options.out, "would be no VRM character without its meshes",
                     "end --out in .vrma or .glb");
  const std::string name = own_clip_name(options, clip, target, *own);
  const auto writer = std::make_shared<GltfClipWriter>(
      options.out, target, own,
      GltfClipWriter::Options{name, options.rate(), options.animation_only});
  return {[writer](const RetargetedFrame& f) {
            writer->push(f.pose, f.confidence, f.fingers ? &*f.fingers : nullptr);
          },
          [writer](const Frames& filled) {
            writer->set_filled(filled);
            writer->commit();
          }};
}

/// A sink whose file has no bones for fingers: says so at the end if the source moved some.
Sink without_fingers(Sink sink) {
  const auto fingers = std::make_shared<bool>(false);
  return {[sink, fingers](const RetargetedFrame& f) {
            *fingers = *fingers || f.fingers;
            sink.push(f);
          },
          [sink, fingers](const Frames& filled) {
            sink.commit(filled);
            if (*fingers) log_warning("the source's fingers are not in the file: it has 22 bones");
          }};
}

/// The motion alone, which every VRM character plays.
Sink vrma_sink(const SinkOptions& options, const Shown& shown, const std::string& clip) {
  const auto writer = std::make_shared<VrmaWriter>(
      options.out, rig_of(shown, options.out).rest,
      options.clip_name.empty() ? clip : options.clip_name, options.rate());
  return without_fingers({[writer](const RetargetedFrame& f) { writer->push(f.pose); },
                          [writer](const Frames&) { writer->commit(); }});
}

/// A GLB file for a target without bones that we know. The file gets a skeleton and a skin of ours.
Sink glb_sink(const SinkOptions& options, const Shown& shown, const std::string& target) {
  const auto bare = std::make_shared<BareDocument>(target, shown.target.vertices.size());
  bare->say_remarks();
  if (!text::ends_in(options.out, {".glb"}) &&
      !(bare->known() && text::ends_in(options.out, {".gltf"})))
    throw InputError(options.out, "keeps the target's own file, which has no rig that we know",
                     "end --out in .glb, or name its bones with --bones");
  if (bare->known()) bare->check(options.out);
  if (options.animation_only || !options.clip_name.empty())
    throw InputError(options.out, "gets a skeleton of ours, whose animation has a fixed name",
                     "leave --clip-name and --animation-only out");
  const SystemRig& rig = rig_of(shown, options.out);
  GlbOptions how;
  how.fps = options.rate();
  if (!options.skeleton.empty()) how.skeleton = options.skeleton;
  const auto writer =
      std::make_shared<GlbWriter>(options.out, shown.target, rig.rest, rig.weights, how);
  const auto commit = [writer, bare, shown, out = options.out](const Frames& filled) {
    writer->set_filled(filled);
    if (bare->known())
      bare->write(writer->bytes(), shown.unposed, out);
    else
      writer->commit();
    const InfluenceError e = writer->influence_error();
    log_info(format("four weights per vertex instead of 22: %.2f mm on average, at most %.2f mm",
                    1e3 * e.mean, 1e3 * e.max));
    const DistanceSummary surface = writer->surface_error();
    if (surface.max > 0)
      log_info(
          format("what a skin cannot hold is left out: the file's surface is "
                 "%.2f mm from the exact one on average, at most %.2f mm (.h5 and folders are "
                 "exact)",
                 1e3 * surface.mean, 1e3 * surface.max));
  };
  return without_fingers({[writer](const RetargetedFrame& f) {
                            writer->push(f.pose, f.confidence,
                                         f.vertices.empty() ? nullptr : &f.vertices);
                          },
                          commit});
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
  how.fps = options.rate();
  const Joints& rest = rig_of(shown, options.out).rest;
  if (own) how.names = bone_names(*own);
  if (!options.skeleton.empty()) how.names = rig_convention(options.skeleton, rest, 0).names;
  const auto writer = std::make_shared<BvhWriter>(options.out, rest, how);
  return without_fingers({[writer](const RetargetedFrame& f) { writer->push(f.pose); },
                          [writer](const Frames&) { writer->commit(); }});
}

Sink hdf5_sink(const SinkOptions& options, const Shown& shown,
               const std::optional<SourceRecord>& source) {
  if (shown.rig == nullptr)  // /joints must be there
    throw InputError(options.out, "holds joints, and this system finds none",
                     "end --out in / for a folder of frames");
  const Mesh& target = shown.target;
  const auto writer = std::make_shared<PredictionWriter>(options.out, std::ssize(target.vertices),
                                                         target.faces, FileInfo{}, options.rate());
  if (source) writer->set_source(*source);
  writer->set_definition(options.joints.empty() ? options.definition : options.joints);
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

/// The same at another rate. Which frames are filled is known frame by frame.
Sink at_rate(Sink sink, double fps) {
  struct State {
    FrameRate rate;
    Frames filled;
    int64_t frames = 0;
  };
  const auto state = std::make_shared<State>(State{FrameRate(fps), {}});
  return {[sink, state](const RetargetedFrame& in) {
            for (const RetargetedFrame& f : state->rate.push(in)) {
              if (f.filled) state->filled.push_back(state->frames);
              ++state->frames;
              sink.push(f);
            }
          },
          [sink, state](const Frames&) { sink.commit(state->filled); }};
}

/// What errors call the result, and the ending that tells its kind.
std::string result_name(const SinkOptions& options) {
  return options.in_memory ? "the result" : options.out;
}
std::string result_kind(const SinkOptions& options) {
  return options.in_memory ? "arrays.h5" : options.out;
}

void check_rate(const SinkOptions& options) {
  const std::string out = result_kind(options), name = result_name(options);
  if (options.every < 1 || options.every > 1000000)
    throw InputError("", "--every is out of range", "give 1 or more frames");
  if (options.every > 1 && !out.ends_with(".h5"))
    throw InputError(name, "holds every frame", "end --out in .h5 with --every");
  if (!(options.fps >= 1 && options.fps <= 1000))
    throw InputError("", "--out-fps is out of range", "give 1 to 1000");
  if (options.fps != kFps && !is_animation(out))
    throw InputError(name, "has the 30 frames a second in which results are computed",
                     "end --out in .glb, .gltf, .vrm, .vrma or .bvh with --out-fps");
}

}  // namespace

void check_sink(const SinkOptions& options) {
  const std::string out = result_kind(options), name = result_name(options);
  if (!options.format.empty() && options.format != "ply" && options.format != "obj")
    throw InputError("", "--format '" + options.format + "' is unknown", "use ply or obj");
  check_rate(options);
  if (!options.skeleton.empty()) check_convention(options.skeleton);
  if (text::ends_in(out, {".fbx"})) {
    const std::string glb = std::filesystem::path(out).stem().string() + ".glb";
    throw InputError(name, "is FBX, which Blender writes",
                     "end --out in .glb; then: blender -b --python docs/glb_to_fbx.py -- " + glb +
                         " " + std::filesystem::path(out).filename().string());
  }
  const auto dot = out.find_last_of('.');
  const auto slash = out.find_last_of('/');
  const bool extension = dot != std::string::npos && (slash == std::string::npos || dot > slash) &&
                         dot + 1 < out.size();
  if (extension && !is_animation(out) && !out.ends_with(".h5"))
    throw InputError(name, "is of no kind that can be written",
                     "end it in .glb, .gltf, .vrm, .vrma, .bvh, .h5, or / for a folder");
  const std::filesystem::path folder = std::filesystem::path(out).parent_path();
  std::error_code error;
  if (extension && !folder.empty() && !std::filesystem::is_directory(folder, error))
    throw InputError(name, "would lie in a folder that is not there", "make the folder first");
  if (!options.format.empty() && extension)
    throw InputError(name, "is no folder, and --format is for a folder's frames",
                     "leave --format out, or end --out in /");
  if (options.animation_only && !is_character(out))
    throw InputError(name, "has no meshes that could be left out",
                     "leave --animation-only out, or end --out in .glb");
  if (!options.clip_name.empty() && (!is_animation(out) || out.ends_with(".bvh")))
    throw InputError(name, "holds no animation that could be named",
                     "leave --clip-name out, or end --out in .glb");
  if (!options.joints.empty() && !out.ends_with(".h5"))
    throw InputError(name, "has no /joints that could be converted",
                     "leave --joints out, or end --out in .h5");
  if (!options.skeleton.empty() && !out.ends_with(".glb") && !out.ends_with(".bvh"))
    throw InputError(name, "has no bones that --skeleton could name",
                     "end --out in .glb or .bvh (a .vrma always has VRM's)");
}

std::string clip_name(const SourceRecord& source) {
  if (!source.clip.empty()) return source.clip;
  std::filesystem::path path(source.path);
  if (!path.has_filename()) path = path.parent_path();  // "scans/"
  const std::string stem = path.stem().string();
  return text::is_utf8(stem) && !stem.empty() && stem != "." && stem != ".." ? stem : "retargeted";
}

Sink in_joints(const SinkOptions& options, Sink sink) {
  if (options.joints.empty()) return sink;
  const JointConversion convert(options.definition, options.joints, options.out);
  const auto push = [convert, to = sink.push](const RetargetedFrame& f) {
    RetargetedFrame other = f;
    if (f.joints) other.joints = convert(*f.joints);
    to(other);
  };
  return {push, sink.commit};
}

Sink make_sink(const SinkOptions& options, const Shown& shown,
               const std::optional<SourceRecord>& source, const std::string& clip,
               const std::string& target, const std::shared_ptr<const GltfOwnRig>& own) {
  if (own && !options.skeleton.empty())
    throw InputError(target, "has a rig of its own, which is kept", "leave --skeleton out");
  const auto timed = [&](Sink sink) {
    return options.fps == kFps ? sink : at_rate(std::move(sink), options.fps);
  };
  if (is_character(options.out))
    return timed(own ? own_sink(options, clip, target, own) : glb_sink(options, shown, target));
  if (is_vrma(options.out)) return timed(vrma_sink(options, shown, clip));
  if (options.out.ends_with(".bvh")) return timed(bvh_sink(options, shown, own));
  if (options.out.ends_with(".h5")) return in_joints(options, hdf5_sink(options, shown, source));
  return folder_sink(options, shown, target);
}

}  // namespace restage::cli
