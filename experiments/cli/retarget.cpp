// restage retarget: clouds of one body in, the same motion by another body out, frame by frame.
#include <chrono>
#include <memory>
#include <optional>

#include "autograd/base/log.h"
#include "autograd/base/output_check.h"
#include "datasets/doctor/examine.h"
#include "datasets/importers/gltf_character.h"
#include "datasets/readers/frame_folder.h"
#include "datasets/readers/gltf.h"
#include "datasets/schema.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/cli/profile.h"
#include "experiments/cli/weights_path.h"
#include "infer/retargeter.h"
#include "infer/writers/bvh.h"
#include "infer/writers/frames.h"
#include "infer/writers/glb.h"

namespace restage::cli {
namespace {

struct RetargetCommand {
  std::string source, target, weights, out, clip, up = "y", format = "ply";
  std::optional<double> fps;        ///< of the source
  std::optional<int64_t> sequence;  ///< of the source, from 0
  double scale = 1, anchor = RetargetOptions{}.anchor;
  bool force = false, profile = false;
  int samples = 4;
};

/// Where results go; one class for each kind of file.
class Sink {
 public:
  virtual ~Sink() = default;
  virtual void push(const RetargetedFrame& frame) = 0;
  virtual void commit() = 0;
};

struct GlbSink final : Sink {
  GlbSink(const std::string& path, const Retargeter& r)
      : writer(path, r.target(), r.rest(), r.weights()) {}
  void push(const RetargetedFrame& f) override { writer.push(f.pose); }
  void commit() override {
    const InfluenceError e = writer.commit();
    char text[160];
    std::snprintf(text, sizeof text,
                  "four weights per vertex instead of 22: %.2f mm on average, at most %.2f mm",
                  1e3 * e.mean, 1e3 * e.max);
    log_info(text);
  }
  GlbWriter writer;
};

struct BvhSink final : Sink {
  BvhSink(const std::string& path, const Retargeter& r) : writer(path, r.rest()) {}
  void push(const RetargetedFrame& f) override { writer.push(f.pose); }
  void commit() override { writer.commit(); }
  BvhWriter writer;
};

struct H5Sink final : Sink {
  H5Sink(const std::string& path, const Retargeter& r)
      : writer(path, static_cast<int64_t>(r.target().vertices.size()), r.target().faces, FileInfo{},
               kFps) {}
  void push(const RetargetedFrame& f) override { writer.append(f.joints, f.vertices); }
  void commit() override { writer.commit(); }
  PredictionWriter writer;
};

struct FolderSink final : Sink {
  FolderSink(const std::string& path, const Retargeter& r, MeshFormat format)
      : writer(path, r.target().faces, format) {}
  void push(const RetargetedFrame& f) override { writer.push(f.vertices); }
  void commit() override { writer.commit(); }
  FrameFolderWriter writer;
};

std::unique_ptr<Sink> make_sink(const RetargetCommand& c, const Retargeter& r) {
  if (c.out.ends_with(".glb")) return std::make_unique<GlbSink>(c.out, r);
  if (c.out.ends_with(".bvh")) return std::make_unique<BvhSink>(c.out, r);
  if (c.out.ends_with(".h5")) return std::make_unique<H5Sink>(c.out, r);
  return std::make_unique<FolderSink>(c.out, r,
                                      c.format == "obj" ? MeshFormat::obj : MeshFormat::ply);
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
  if (c.samples < 1 || c.samples > 256)
    throw InputError("", "--samples is out of range", "give 1 to 256");
  const auto dot = c.out.find_last_of('.');
  const auto slash = c.out.find_last_of('/');
  const bool extension = dot != std::string::npos && (slash == std::string::npos || dot > slash) &&
                         dot + 1 < c.out.size();
  if (extension && !c.out.ends_with(".glb") && !c.out.ends_with(".bvh") && !c.out.ends_with(".h5"))
    throw InputError(c.out, "is of no kind that can be written",
                     "end it in .glb, .bvh, .h5, or / for a folder");
  check_output(c.out, {c.source, c.target, weights_path(c.weights)});
}

void to_metres(const RetargetCommand& c, Points& points) {
  for (Point& p : points) {
    if (c.up == "z") p = Point(p[0], p[2], -p[1]);
    p *= static_cast<float>(c.scale);
  }
}

/// The doctor's words on what would make the result nonsense.
void check_inputs(const RetargetCommand& c, FrameSource& frames, const TargetMesh& target) {
  if (c.force) return;
  check_target(target.mesh, c.target, target.joints ? &*target.joints : nullptr);
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
  char text[96];
  std::snprintf(text, sizeof text, "peak of tensors %.1f MiB",
                static_cast<double>(memory_stats().peak) / 1048576.0);
  log_info(text);
}

/// How a character was brought into T-pose; nothing for a plain mesh. Said when all is done: bad
/// input, which may come late in a source, is answered with one line.
void log_target(const ImportReport& report) {
  for (const auto& [name, value] : report.facts)
    if (name != "joints") log_info(report.file + ": " + name + ": " + value);
  for (const std::string& remark : report.remarks) log_info(report.file + ": " + remark);
}

int run_retarget(const RetargetCommand& c, const Common& common) {
  check(c);
  const ModelSet models =
      load_models(weights_path(c.weights), {.skeleton = true, .smrm = true, .deformation = true});
  const auto frames = open_frames(c.source, {c.clip, common.max_memory, c.sequence});
  if (!c.sequence && frames->sequences() > 1)
    throw InputError(c.source, "holds " + std::to_string(frames->sequences()) + " sequences",
                     "choose one with --sequence N, from 0");
  RetargetOptions options;
  options.fps = c.fps.value_or(frames->fps());
  options.force = c.force;
  options.seed = common.seed;
  options.samples = c.samples;
  options.anchor = c.anchor;
  TargetMesh target = read_target(c.target);
  check_inputs(c, *frames, target);
  Retargeter retargeter(models, std::move(target.mesh), c.target, options);
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
  const auto sink = make_sink(c, retargeter);
  Profile profile({"read", "extract", "motion", "deformation", "write", "frame"});
  int64_t in = 0, out = 0;
  for (; frame; frame = next(), ++in) {
    const Clock::time_point start = Clock::now();
    if (!c.force) check_frame(frame->points, frame->source);
    const auto made = retargeter.push(frame->points, frame->source);
    const Clock::time_point pushed = Clock::now();
    for (const RetargetedFrame& f : made) sink->push(f);
    const double write = seconds_since(pushed), work = seconds_since(start);
    const FrameTimes& times = retargeter.times();
    profile.add({read, times.extract, times.motion, times.deformation, write, read + work});
    out += std::ssize(made);
  }
  sink->commit();
  log_target(target.report);
  if (c.profile) log_profile(profile);
  if (common.json) {
    Json document = {{"out", c.out},
                     {"source_frames", in},
                     {"frames", out},
                     {"fps", kFps},
                     {"seed", common.seed}};
    if (c.profile) document["profile"] = profile.json();
    print_json(document);
  } else {
    print("wrote " + c.out + ": " + std::to_string(out) + " frames (seed " +
          std::to_string(common.seed) + ")\n");
  }
  return 0;
}

}  // namespace

void add_retarget(Program& program) {
  const auto c = std::make_shared<RetargetCommand>();
  CLI::App& app = program.add(
      "retarget", "a target performs the motion of a sequence of clouds",
      "restage retarget --source scans/ --target hero.obj --weights w.safetensors --out hero.glb\n"
      "restage retarget --source scans.h5 --target hero.ply --weights runs/demo-1 --out result.h5",
      [c, &program] { return run_retarget(*c, program.common()); });
  app.add_option("--source", c->source,
                 "folder of clouds, file of them (HDF5, NPZ, NPY), or glTF animation")
      ->required();
  app.add_option("--target", c->target,
                 "mesh or cloud in T-pose, y up, facing +z; or a glTF character")
      ->required();
  app.add_option("--weights", c->weights, "weights file or run directory")->required();
  app.add_option("--out", c->out, "X.glb, X.bvh, X.h5, or a folder for PLY or OBJ frames")
      ->required();
  app.add_option("--clip", c->clip, "animation of a glTF source (default: the first)");
  app.add_option("--sequence", c->sequence, "which sequence of an HDF5 source, from 0");
  app.add_option("--fps", c->fps, "frames per second of the source (default: the file's, else 30)");
  app.add_option("--source-up", c->up, "the source's up axis, y or z");
  app.add_option("--scale", c->scale, "the source's units in metres");
  app.add_option("--format", c->format, "of a folder's frames: ply or obj");
  app.add_option("--samples", c->samples, "random choices of points per frame to average");
  app.add_option("--anchor", c->anchor,
                 "seconds in which the path goes back to the source's, scaled to the target's legs "
                 "(0: never)");
  app.add_flag("--force", c->force,
               "accept a target that is no T-pose, and what else the doctor calls wrong");
  app.add_flag("--profile", c->profile,
               "say how long a frame and its parts take: p50, p95, p99, max");
}

}  // namespace restage::cli
