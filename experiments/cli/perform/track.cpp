// restage track: one mesh over all scans of somebody.
#include <chrono>
#include <deque>
#include <filesystem>

#include "autograd/base/format.h"
#include "autograd/base/log.h"
#include "autograd/base/output_check.h"
#include "datasets/readers/text/text.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/perform/retarget.h"
#include "experiments/cli/perform/retarget_gaps.h"
#include "experiments/cli/perform/retarget_words.h"
#include "experiments/cli/perform/source_options.h"
#include "experiments/cli/perform/standard_weights.h"
#include "experiments/slow_work.h"
#include "experiments/source.h"
#include "infer/track/components.h"
#include "infer/track/tracker.h"
#include "infer/writers/glb.h"

namespace restage::cli {
namespace {

constexpr size_t kMostTargets = 64;
constexpr double kPoorFit = 0.025;  // metres: 95 % of the points are nearer in a frame that fits
constexpr double kPoorRatio = 2;    // to the middle of all frames'

struct TrackCommand {
  RetargetCommand how;
  double error = 1;  ///< mm
};

bool is_glb(const std::string& out) { return text::ends_in(out, {".glb"}); }

void check(const TrackCommand& c) {
  const std::string& out = c.how.to.out;
  const bool folder = std::filesystem::path(out).extension().empty();
  if (!is_glb(out) && !folder && !out.ends_with(".h5"))
    throw InputError(out, "is of no kind that can be written",
                     "end it in .glb, .h5, or / for a folder of frames");
  check_sink(c.how.to);
  if (!(c.error > 0 && c.error <= 1000))
    throw InputError("", "--error is out of range", "give millimetres above 0, up to 1000");
  std::vector<std::string> inputs = {c.how.source.path, c.how.target};
  if (!c.how.weights.empty()) inputs.push_back(weights_path(c.how.weights));
  if (!c.how.bones.empty()) inputs.push_back(c.how.bones);
  check_output(out, inputs);
}

/// What is known of all frames.
struct Take {
  std::vector<Pose> poses;
  std::vector<Points> offsets;  ///< for a GLB file only
  std::vector<std::optional<double>> confidence;
  std::vector<std::optional<MiddleAndMost>> distance;
  std::vector<int64_t> filled;
  size_t points_left_out = 0;

  int64_t frames() const { return std::ssize(poses); }
  /// The middle of all frames' distances.
  MiddleAndMost middle() const {
    std::vector<double> medians, p95s;
    for (const auto& d : distance)
      if (d) medians.push_back(d->median), p95s.push_back(d->p95);
    return {middle_and_most(medians).median, middle_and_most(p95s).median};
  }
  std::vector<int64_t> poor() const {
    const double limit = std::max(kPoorFit, kPoorRatio * middle().p95);
    std::vector<int64_t> out;
    for (size_t f = 0; f < distance.size(); ++f)
      if (distance[f] && distance[f]->p95 > limit) out.push_back(static_cast<int64_t>(f));
    return out;
  }
};

/// All frames through the networks, which answer some frames late, and the tracker.
class TrackRun {
 public:
  TrackRun(const TrackCommand& c, Source& source, System& system, Tracker& tracker, Gaps& gaps,
           const Sink* sink)
      : source_(source),
        system_(system),
        tracker_(tracker),
        gaps_(gaps),
        sink_(sink),
        door_(frame_of(source.record()), c.how.options.force, true) {}

  Take operator()() {
    for (auto cloud = source_.next(); cloud; cloud = source_.next()) {
      slow_.on("frame " + std::to_string(in_ + 1) + " of " + std::to_string(source_.frames()) +
               time_left());
      take_.points_left_out += cloud->frame.left_out;
      push(*cloud);
      answer();
      ++in_;
    }
    gaps_.check_any();
    system_.finish([this](const RetargetedFrame& f) { shown_.push_back(f); });
    answer();
    slow_.on("");
    return std::move(take_);
  }

 private:
  /// A cloud that the networks have not answered yet; without points: it could not be used.
  struct Unanswered {
    Points points;
    Joints seen{};
    std::string source;
  };

  /// As the frames so far took.
  std::string time_left() const {
    if (in_ == 0) return "";
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start_;
    const auto done = static_cast<double>(in_), all = static_cast<double>(source_.frames());
    return format(", about %.0f s left", spent.count() * (all - done) / done);
  }

  void push(SourceCloud& cloud) {
    const Points& points = cloud.frame.points;
    const std::string name = cloud.frame.source;
    std::optional<InputError> fault = cloud.fault;
    if (!fault) try {
        door_.pass(points, name, [&] {
          system_.push(points, name, [this](const RetargetedFrame& f) { shown_.push_back(f); });
        });
      } catch (const UnusableCloud& unusable) {
        fault = unusable;
      }
    if (fault) {
      gaps_.add(in_, *fault);
      system_.miss();
      waiting_.emplace_back();
      return;
    }
    gaps_.end();
    waiting_.push_back({std::move(cloud.frame.points), *system_.source_joints(), name});
  }

  void answer() {
    for (RetargetedFrame& f : shown_) {
      if (waiting_.empty()) throw WorkError("the system showed more frames than it was given");
      const Unanswered& in = waiting_.front();
      const bool seen = !in.points.empty();
      TrackedFrame found =
          tracker_(f.pose, seen ? &in.seen : nullptr, seen ? &in.points : nullptr, in.source);
      if (f.filled) take_.filled.push_back(take_.frames());
      take_.poses.push_back(found.pose);
      take_.confidence.push_back(f.confidence);
      take_.distance.push_back(found.distance);
      if (sink_ == nullptr) {
        take_.offsets.push_back(std::move(found.offsets));
      } else {
        f.joints = forward_kinematics(tracker_.body().joints, found.pose).joints;
        f.pose = found.pose;
        f.vertices = std::move(found.vertices);
        sink_->push(f);
      }
      waiting_.pop_front();
    }
    shown_.clear();
  }

  Source& source_;
  System& system_;
  Tracker& tracker_;
  Gaps& gaps_;
  const Sink* sink_;
  CloudDoor door_;
  SlowWork slow_;
  std::deque<Unanswered> waiting_;
  std::vector<RetargetedFrame> shown_;
  Take take_;
  int64_t in_ = 0;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// The rig's animation, and the surface's rest as morph targets.
Json write_glb(const TrackCommand& c, const Body& body, const std::string& clip, Take& take) {
  const SurfaceComponents found =
      surface_components(std::move(take.offsets), 1e-3 * c.error, kMostTargets);
  Mesh mesh = body.rest;
  for (size_t v = 0; v < mesh.vertices.size(); ++v) mesh.vertices[v] += found.mean[v];
  GlbOptions how;
  how.clip = clip;
  if (!c.how.to.skeleton.empty()) how.skeleton = c.how.to.skeleton;
  GlbWriter writer(c.how.to.out, mesh, body.joints, body.weights, how);
  GlbMorphs morphs{found.deltas, found.weights, found.error, {}};
  const bool sure = std::all_of(take.confidence.begin(), take.confidence.end(),
                                [](const auto& x) { return x.has_value(); });
  for (size_t f = 0; f < take.poses.size(); ++f) {
    writer.push(take.poses[f], sure ? take.confidence[f] : std::nullopt);
    morphs.distance.push_back(take.distance[f] ? take.distance[f]->median : -1.0);
  }
  writer.set_filled(take.filled);
  writer.set_morphs(std::move(morphs));
  writer.commit();
  if (found.error.p95 > 1e-3 * c.error)
    log_warning(format("%zu morph targets keep 95 %% of the vertices' errors below %.2f mm only",
                       kMostTargets, 1e3 * found.error.p95));
  const auto bytes = static_cast<double>(std::filesystem::file_size(c.how.to.out));
  return {{"morph_targets", found.deltas.size()},
          {"surface_error_mm",
           {{"mean", 1e3 * found.error.mean},
            {"p95", 1e3 * found.error.p95},
            {"max", 1e3 * found.error.max}}},
          {"bytes", bytes},
          {"kilobytes_per_second", 1e-3 * bytes * kFps / static_cast<double>(take.frames())}};
}

Json document_of(const TrackCommand& c, const Common& common, const Take& take, const Gaps& gaps,
                 const Source& source) {
  Json distances = Json::array(), confidence = Json::array();
  for (const auto& d : take.distance)
    distances.push_back(d ? Json({{"median", 1e3 * d->median}, {"p95", 1e3 * d->p95}}) : Json());
  for (const auto& sure : take.confidence) confidence.push_back(sure ? Json(*sure) : Json());
  const MiddleAndMost middle = take.middle();
  return {{"out", c.how.to.out},
          {"source_frames", source.frames()},
          {"frames", take.frames()},
          {"fps", kFps},
          {"seed", common.seed},
          {"distance_mm", {{"median", 1e3 * middle.median}, {"p95", 1e3 * middle.p95}}},
          {"frame_distances_mm", distances},
          {"confidence", confidence},
          {"poor_frames", take.poor()},
          {"missing", gaps.json()},
          {"filled", take.filled},
          {"points_left_out", take.points_left_out}};
}

std::string text_of(const Json& document, const Take& take) {
  std::string out = "wrote " + document["out"].get<std::string>() + ": " +
                    counted(take.frames(), "frame") +
                    format("; its points are %.1f mm from the surface, 95 %% below %.1f mm",
                           1e3 * take.middle().median, 1e3 * take.middle().p95);
  if (document.contains("morph_targets"))
    out += format(
        "; %d morph targets, exact to %.2f mm (95 %%), %.0f kB, %.0f kB/s",
        document["morph_targets"].get<int>(), document["surface_error_mm"]["p95"].get<double>(),
        1e-3 * document["bytes"].get<double>(), document["kilobytes_per_second"].get<double>());
  return out + " (seed " + std::to_string(document["seed"].get<uint64_t>()) + ")\n";
}

int run_track(const TrackCommand& given, const Common& common) {
  TrackCommand c = given;
  // The person's own motion, in the person's own place.
  c.how.floor = c.how.contacts = "off";
  c.how.options.foot_lock = false;
  c.how.options.late = true;
  check(c);
  SystemInput input = load_input(c.how, common);
  Source source(c.how.source, common.max_memory);
  if (source.frames() == 0)
    throw InputError(c.how.source.path, "holds no frames", "give at least one cloud");
  if (source.fps() != kFps)
    throw InputError(c.how.source.path,
                     format("has %g frames a second, and a surface is fitted to 30", source.fps()),
                     "give scans of 30 frames a second, or --fps 30 if they are");
  TargetMesh target = read_target(c.how.target, c.how.bones);
  check_mesh(c.how, target);
  if (!c.how.options.force) check_first_frames(source);
  const SinkOptions to = sink_options(c.how, input, target);
  const auto system = system_for(c.how, std::move(input), target);
  const SystemRig& rig = *system->rig();
  Body body;
  body.rest = system->target();
  body.joints = rig.rest;
  body.weights = rig.weights;
  Tracker tracker(std::move(body), c.how.target);
  std::optional<Sink> sink;
  const Shown shown{system->target(), system->rig(), nullptr};
  if (!is_glb(to.out))
    sink = make_sink(to, shown, source.record(), clip_name(source.record()), c.how.target, nullptr);
  Gaps gaps(source.frames(), source.fps(), c.how.options.force);
  Take take = TrackRun(c, source, *system, tracker, gaps, sink ? &*sink : nullptr)();
  Json document = document_of(c, common, take, gaps, source);
  if (sink) sink->commit(take.filled);
  if (!sink) document.update(write_glb(c, tracker.body(), clip_name(source.record()), take));
  say_target(target);
  for (const std::string& line : source.remarks()) log_warning(line);
  for (const std::string& line : gaps.lines(take.filled)) log_warning(line);
  if (const auto poor = take.poor(); !poor.empty())
    log_warning("the surface fits badly in " + counted(std::ssize(poor), "frame") + ": " +
                listed(poor, 8));
  print(common.json, document, text_of(document, take));
  return 0;
}

}  // namespace

void add_track(Program& program) {
  auto [app, c] = program.add(
      "track", "one mesh over all scans of somebody: a rigged character with a surface that moves",
      "restage track --source scans/ --template body.obj --out actor.glb\n"
      "restage track scans.h5 body.ply actor.glb --error 0.5 --skeleton mixamo --json\n"
      "restage track --source scans/ --template body.ply --out frames/ --format ply\n"
      "restage track --source mm/ --scale mm --source-up z --fps 30 --template body.ply --out "
      "a.h5\n"
      "restage track --source s.h5 --sequence 2 --template body.glb --bones names.yaml --out a.h5\n"
      "restage track --source dance.glb --clip Walk --template body.ply --weights w --device cpu "
      "--out a.glb --force",
      run_track);
  app.add_option("--source,SOURCE", c.how.source.path,
                 "clouds of one person, 30 a second: a folder, HDF5 file, glTF or arrays")
      .required();
  app.add_option("--template,TEMPLATE", c.how.target,
                 "the same person's mesh, with faces, y up, best in T-pose facing +z")
      .required();
  app.add_option("--out,OUT", c.how.to.out, "X.glb, X.h5, or a folder for PLY or OBJ frames")
      .required();
  app.add_option("--error", c.error,
                 "of X.glb: as many morph targets are kept, up to 64, that 95 % of the vertices' "
                 "errors are below so many mm (default: 1)");
  app.add_option("--skeleton", c.how.to.skeleton,
                 "names and axes of the bones of X.glb: restage, smpl, mixamo, vrm, unreal "
                 "(default: restage)");
  app.add_option("--format", c.how.to.format,
                 "of a folder's frames: ply or obj (default: the template's own, else ply)");
  app.add_option("--bones", c.how.bones,
                 "which bone of a rigged template is which joint, a .yaml file or a known family "
                 "(default: found)");
  app.add_option("--weights", c.how.weights,
                 "weights file, run, artifact, standard or lite (default: standard)");
  app.add_option("--device", c.how.device,
                 "where extractor and motion network run: cpu, or cuda in a program built for it");
  add_source_options(app, c.how.source);
  add_force(app, c.how.options.force,
            "a template that is no T-pose, clouds in which nobody is found, gaps of over a third "
            "of a second");
}

}  // namespace restage::cli
