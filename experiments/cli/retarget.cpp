// restage retarget: clouds of one body in, the same motion by another body out, frame by frame.
#include <chrono>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>

#include "autograd/base/format.h"
#include "autograd/base/log.h"
#include "autograd/base/output_check.h"
#include "autograd/kernels/kernel.h"
#include "datasets/doctor/examine.h"
#include "datasets/importers/gltf_character.h"
#include "datasets/readers/frame_folder.h"
#include "datasets/readers/gltf.h"
#include "datasets/schema.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/cli/profile.h"
#include "infer/systems.h"
#include "infer/writers/bvh.h"
#include "infer/writers/frames.h"
#include "infer/writers/glb.h"

namespace restage::cli {
namespace {

struct RetargetCommand {
  std::string source, target, bones, weights, out, clip, up = "y", format = "ply", device = "cpu";
  std::string system = "chain", rest;
  std::optional<double> fps;        ///< of the source
  std::optional<int64_t> sequence;  ///< of the source, from 0
  RetargetOptions options;
  double scale = 1;
  bool profile = false;
  int64_t every = 1;
};

/// Where results go: what a writer takes of each frame, and how it ends.
struct Sink {
  std::function<void(const RetargetedFrame&)> push;
  std::function<void()> commit;
};

/// What the skeleton's files are made of.
const SystemRig& rig_of(const System& system, const std::string& out) {
  if (system.rig() == nullptr)
    throw InputError(out, "needs a skeleton, which this system does not have",
                     "end it in .h5, or / for a folder of frames");
  return *system.rig();
}

Sink make_sink(const RetargetCommand& c, const System& s) {
  if (c.out.ends_with(".glb")) {
    const SystemRig& rig = rig_of(s, c.out);
    const auto writer = std::make_shared<GlbWriter>(c.out, s.target(), rig.rest, rig.weights);
    const auto commit = [writer] {
      const InfluenceError e = writer->commit();
      log_info(format("four weights per vertex instead of 22: %.2f mm on average, at most %.2f mm",
                      1e3 * e.mean, 1e3 * e.max));
    };
    return {[writer](const RetargetedFrame& f) { writer->push(f.pose, f.confidence); }, commit};
  }
  if (c.out.ends_with(".bvh")) {
    const auto writer = std::make_shared<BvhWriter>(c.out, rig_of(s, c.out).rest);
    return {[writer](const RetargetedFrame& f) { writer->push(f.pose); },
            [writer] { writer->commit(); }};
  }
  const Mesh& target = s.target();
  if (c.out.ends_with(".h5")) {
    const auto writer =
        std::make_shared<PredictionWriter>(c.out, std::ssize(target.vertices), target.faces,
                                           FileInfo{}, kFps / static_cast<double>(c.every));
    return {
        [writer](const RetargetedFrame& f) { writer->append(f.joints, f.vertices, f.confidence); },
        [writer] { writer->commit(); }};
  }
  const auto writer = std::make_shared<FrameFolderWriter>(
      c.out, target.faces, c.format == "obj" ? MeshFormat::obj : MeshFormat::ply);
  return {[writer](const RetargetedFrame& f) { writer->push(f.vertices); },
          [writer] { writer->commit(); }};
}

void check(const RetargetCommand& c) {
  if (c.up != "y" && c.up != "z")
    throw InputError("", "--source-up '" + c.up + "' is unknown", "use y or z");
  if (c.format != "ply" && c.format != "obj")
    throw InputError("", "--format '" + c.format + "' is unknown", "use ply or obj");
  if (!(c.scale >= kLeastScale && c.scale <= kMostScale))
    throw InputError("", "--scale is out of range", "give metres per unit, 1e-9 to 1e6");
  if (c.fps && !(*c.fps >= 1 && *c.fps <= 1000))
    throw InputError("", "--fps is out of range", "give the source's frames per second, 1 to 1000");
  if (c.fps && is_gltf_name(c.source))
    throw InputError(c.source, "states its key times, which --fps cannot change",
                     "leave --fps out");
  if (system_type(c.system).weights && c.weights.empty())
    throw InputError("", "--weights is missing", "give a weights file or a run");
  if (c.every < 1 || c.every > 1000000)
    throw InputError("", "--every is out of range", "give 1 or more frames");
  if (c.every > 1 && !c.out.ends_with(".h5"))
    throw InputError(c.out, "is played at 30 frames a second", "end --out in .h5 with --every");
  if (!(c.options.min_confidence >= 0 && c.options.min_confidence <= 1))
    throw InputError("", "--min-confidence is out of range", "give 0 to 1");
  if (c.options.samples < 1 || c.options.samples > 256)
    throw InputError("", "--samples is out of range", "give 1 to 256");
  const auto dot = c.out.find_last_of('.');
  const auto slash = c.out.find_last_of('/');
  const bool extension = dot != std::string::npos && (slash == std::string::npos || dot > slash) &&
                         dot + 1 < c.out.size();
  if (extension && !c.out.ends_with(".glb") && !c.out.ends_with(".bvh") && !c.out.ends_with(".h5"))
    throw InputError(c.out, "is of no kind that can be written",
                     "end it in .glb, .bvh, .h5, or / for a folder");
  std::vector<std::string> inputs = {c.source, c.target};
  if (!c.weights.empty()) inputs.push_back(weights_path(c.weights));
  for (const std::string& more : {c.rest, c.bones})
    if (!more.empty()) inputs.push_back(more);
  check_output(c.out, inputs);
}

void to_metres(const RetargetCommand& c, Points& points) {
  for (Point& p : points) {
    if (c.up == "z") p = Point(p[0], p[2], -p[1]);
    p *= static_cast<float>(c.scale);
  }
}

/// A target that is refused as it stands may only lack the names of its bones: then that is what
/// there is to mend.
template <class Work>
auto with_target(const RetargetCommand& c, const TargetMesh& target, const Work& work) {
  try {
    return work();
  } catch (const InputError& error) {
    if (target.unknown_rig.empty() || !std::string(error.what()).starts_with(c.target)) throw;
    throw InputError(
        c.target, "it would be posed by its rig, which was not recognised: " + target.unknown_rig,
        "say which bone is which joint with --bones names.yaml (docs/data.md)");
  }
}

/// The doctor's words on what would make the result nonsense.
void check_inputs(const RetargetCommand& c, FrameSource& frames, const TargetMesh& target) {
  if (c.options.force) return;
  with_target(c, target, [&] {
    check_target(target.mesh, c.target, target.joints ? &*target.joints : nullptr);
  });
  std::vector<Mesh> first;
  while (first.size() < kSourceFrames) {
    auto frame = frames.next();
    if (!frame) break;
    to_metres(c, frame->points);
    first.push_back({std::move(frame->points), std::move(frame->faces)});
  }
  frames.rewind();
  check_source(first, c.source, {c.scale, c.up == "z"});
}

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

void log_profile(const Profile& profile) {
  for (const std::string& line : profile.lines()) log_info(line);
  log_info(
      format("peak of tensors %.1f MiB", static_cast<double>(memory_stats().peak) / 1048576.0));
}

/// How a character was brought into T-pose; nothing for a plain mesh. Said when all is done: bad
/// input, which may come late in a source, is answered with one line.
void log_target(const ImportReport& report) {
  for (const auto& [name, value] : report.facts)
    if (name != "joints") log_info(report.file + ": " + name + ": " + value);
  for (const std::string& remark : report.remarks) log_info(report.file + ": " + remark);
}

Joints rest_joints(const std::string& path) {
  const Prediction rest = read_prediction(path);
  if (rest.joints.empty() || rest.frames != 1)
    throw InputError(path + ":/joints", "is not one skeleton",
                     "give the target's rest joints as [1, 22, 3]");
  Joints out;
  for (size_t j = 0; j < out.size(); ++j) out[j] = Eigen::Map<const Vec3>(&rest.joints[3 * j]);
  return out;
}

int run_retarget(const RetargetCommand& c, const Common& common) {
  check(c);
  SystemInput input;
  if (!c.weights.empty()) {
    input.weights_name = weights_path(c.weights);
    input.weights = load_bundle(c.weights);
    for (const char* role : {"skeleton", "motion", "deformation.weights"})
      if (system_type(c.system).weights) input.weights.need(role, input.weights_name);
    move_networks(input.weights, {"skeleton", "motion"}, device_of(c.device));
  }
  const auto frames = open_frames(c.source, {c.clip, common.max_memory, c.sequence});
  if (!c.sequence && frames->sequences() > 1)
    throw InputError(c.source, "holds " + std::to_string(frames->sequences()) + " sequences",
                     "choose one with --sequence N, from 0");
  input.options = c.options;
  input.options.fps = c.fps.value_or(frames->fps());
  input.options.seed = common.seed;
  TargetMesh target = read_target(c.target, c.bones);
  check_inputs(c, *frames, target);
  if (!c.rest.empty()) input.rest = rest_joints(c.rest);
  // The joints that a rig names are where its maker put them, not where a network finds them.
  if (c.rest.empty() && !system_type(c.system).weights) input.rest = target.joints;
  input.target = std::move(target.mesh);
  input.target_name = c.target;
  const auto system =
      with_target(c, target, [&] { return system_type(c.system).make(std::move(input)); });
  // The first frame is looked at before anything is written or logged.
  double read = 0;
  const auto next = [&] {
    const Clock::time_point start = Clock::now();
    auto frame = frames->next();
    if (frame) to_metres(c, frame->points);
    read = seconds_since(start);
    return frame;
  };
  auto frame = next();
  if (!frame) throw InputError(c.source, "holds no frames", "give at least one cloud");
  const Sink sink = make_sink(c, *system);
  Profile profile({"read", "extract", "motion", "deformation", "write", "frame"});
  int64_t in = 0, out = 0, held = 0;
  Json confidence = Json::array();
  const auto write_all = [&](std::span<const RetargetedFrame> made) {
    for (const RetargetedFrame& f : made) {
      sink.push(f);
      if (!f.confidence) continue;
      confidence.push_back(std::round(*f.confidence * 1e3) / 1e3);
      held += *f.confidence < c.options.min_confidence;
    }
    out += std::ssize(made);
  };
  for (; frame; frame = next(), ++in) {
    if (in % c.every != 0) continue;
    const Clock::time_point start = Clock::now();
    if (!c.options.force) check_frame(frame->points, frame->source);
    const auto made = system->push(frame->points, frame->source);
    const Clock::time_point pushed = Clock::now();
    write_all(made);
    const double write = seconds_since(pushed), work = seconds_since(start);
    const FrameTimes times = system->times();
    profile.add({read, times.extract, times.motion, times.deformation, write, read + work});
  }
  write_all(system->finish());
  sink.commit();
  log_target(target.report);
  if (c.profile) log_profile(profile);
  Json document = {
      {"out", c.out}, {"source_frames", in}, {"frames", out}, {"fps", kFps}, {"seed", common.seed}};
  if (!confidence.empty()) {
    document["held"] = held;
    document["confidence"] = confidence;
  }
  if (c.profile) document["profile"] = profile.json();
  print(common.json, document,
        "wrote " + c.out + ": " + std::to_string(out) + " frames (seed " +
            std::to_string(common.seed) + ")" +
            (held > 0 ? "; in " + std::to_string(held) + " of them the target waits" : "") + "\n");
  return 0;
}

std::string help_of_systems() {
  std::string out;
  for (const SystemType& type : systems())
    out += (out.empty() ? "" : "; ") + type.name + ": " + type.help;
  return out;
}

}  // namespace

void add_retarget(Program& program) {
  auto [app, c] = program.add(
      "retarget", "a target performs the motion of a sequence of clouds",
      "restage retarget --source scans/ --target hero.obj --weights w.safetensors --out hero.glb\n"
      "restage retarget --source scans.h5 --target hero.ply --weights runs/demo-1 --out result.h5\n"
      "restage retarget --source mm/ --fps 60 --source-up z --scale 0.001 --target a.obj --weights "
      "w "
      "--out a.glb\n"
      "restage retarget --source walk.glb --clip Walk --target hero.vrm --weights w --out "
      "hero.bvh\n"
      "restage retarget --source scans/ --target odd_names.glb --bones names.yaml --weights w "
      "--out "
      "r.glb\n"
      "restage retarget --source s.h5 --sequence 2 --target a.obj --weights w --out f/ --format "
      "ply\n"
      "restage retarget --source s.h5 --target a.ply --weights w --out r.h5 --every 3 --samples 8\n"
      "restage retarget --source s.h5 --target a.ply --weights w --out r.h5 --force --profile\n"
      "restage retarget --source s.h5 --target a.ply --weights w --out r.h5 --min-confidence 0.5\n"
      "restage retarget --source s.h5 --target a.ply --weights w --out r.h5 --device cuda\n"
      "restage retarget --source s.h5 --target a.ply --weights w --out r.h5 --anchor 0 "
      "--no-foot-lock\n"
      "restage retarget --source scans.h5 --target hero.ply --system register --rest rest.h5 "
      "--out r.h5",
      run_retarget);
  app.add_option("--source", c.source,
                 "folder of clouds, file of them (HDF5, NPZ, NPY), or glTF animation")
      ->required();
  app.add_option("--target", c.target,
                 "mesh or cloud in T-pose, y up, facing +z; or a glTF character")
      ->required();
  app.add_option("--bones", c.bones,
                 "which bone of a glTF target is which joint, a .yaml file or a known family");
  app.add_option("--weights", c.weights, "weights file, run or artifact");
  app.add_option("--system", c.system, help_of_systems())->capture_default_str();
  app.add_option("--rest", c.rest, "the target's 22 rest joints (HDF5, /joints [1, 22, 3])");
  app.add_option("--every", c.every, "only every so many frames of the source; for X.h5");
  app.add_option("--out", c.out, "X.glb, X.bvh, X.h5, or a folder for PLY or OBJ frames")
      ->required();
  app.add_option("--clip", c.clip, "animation of a glTF source (default: the first)");
  app.add_option("--sequence", c.sequence, "which sequence of an HDF5 source, from 0");
  app.add_option("--fps", c.fps, "frames per second of the source (default: the file's, else 30)");
  app.add_option("--source-up", c.up, "the source's up axis, y or z");
  app.add_option("--scale", c.scale, "the source's units in metres");
  app.add_option("--format", c.format, "of a folder's frames: ply or obj");
  app.add_option("--device", c.device,
                 "where extractor and motion network run: cpu, or cuda in a program built for it");
  app.add_option("--samples", c.options.samples,
                 "views of a cloud to average: choices of its points, turned and mirrored");
  app.add_option("--anchor", c.options.anchor,
                 "seconds in which the path goes back to the source's, scaled to the target's legs "
                 "(0: never)");
  app.add_option("--min-confidence", c.options.min_confidence,
                 "the target waits where the extractor is less sure than this, 0 to 1 (0: never)");
  app.add_flag("!--no-foot-lock", c.options.foot_lock,
               "feet that stand are not held where they landed");
  app.add_flag("--force", c.options.force,
               "accept a target that is no T-pose, and what else the doctor calls wrong");
  app.add_flag("--profile", c.profile,
               "say how long a frame and its parts take: p50, p95, p99, max");
}

}  // namespace restage::cli
