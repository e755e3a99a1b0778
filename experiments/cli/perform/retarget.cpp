// restage retarget: clouds of one body in, the same motion by another body out, frame by frame.
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>

#include "autograd/base/format.h"
#include "autograd/base/log.h"
#include "autograd/base/output_check.h"
#include "autograd/base/words.h"
#include "autograd/kernels/kernel.h"
#include "datasets/doctor/examine.h"
#include "datasets/importers/motions/skeleton_take.h"
#include "datasets/readers/text/text.h"
#include "datasets/schema.h"
#include "experiments/cli/output.h"
#include "experiments/cli/perform/retarget.h"
#include "experiments/cli/perform/retarget_gaps.h"
#include "experiments/cli/perform/retarget_words.h"
#include "experiments/cli/perform/source_options.h"
#include "experiments/cli/perform/standard_weights.h"
#include "experiments/cli/training/profile.h"
#include "experiments/source.h"
#include "experiments/text.h"
#include "infer/frame_rate.h"

namespace restage::cli {
namespace {

using Frames = std::vector<int64_t>;  ///< their numbers

void check(const RetargetCommand& c, const RetargetCaller& caller) {
  SinkOptions to = c.to;
  to.in_memory = static_cast<bool>(caller.sink);
  check_sink(to);
  check_options(c.options, system_type(c.system));
  if (caller.sink) return;
  std::vector<std::string> inputs = {c.target};
  if (!caller.clouds) inputs.push_back(c.source.path);
  if (!c.weights.empty()) inputs.push_back(weights_path(c.weights));
  for (const std::string& more : {c.rest, c.bones, c.source_bones, c.body_model, c.asf})
    if (!more.empty()) inputs.push_back(more);
  check_output(c.to.out, inputs);
}

/// The doctor's words on what would make the result nonsense.
void check_inputs(const RetargetCommand& c, Source& source, const TargetMesh& target) {
  check_mesh(c, target);
  if (!c.options.force) check_first_frames(source);
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

/// What has become of the source.
struct Outcome {
  Frames filled;  ///< RetargetedFrame::filled
  int64_t frames = 0, held = 0;
  size_t points_left_out = 0;
  std::vector<double> confidence, sure;  ///< of all frames; of those that a cloud is behind
  SparseWatch sparse;
};

/// All frames of the source through the system and into the sink, which is not committed.
class Run {
 public:
  Run(const RetargetCommand& c, SinkOptions to, Source& source, System& system,
      const TargetMesh& target, Gaps& gaps, Profile& profile, const RetargetCaller& caller,
      bool from_memory)
      : c_(c),
        to_(std::move(to)),
        caller_(caller),
        source_(source),
        system_(system),
        target_(target),
        gaps_(gaps),
        profile_(profile),
        from_memory_(from_memory),
        door_(frame_of(source.record()), c.options.force, true) {}

  Outcome operator()() {
    // The first frame is looked at before anything is written or logged.
    for (auto cloud = next(); cloud; cloud = next()) {
      caller_.look();
      out_.points_left_out += cloud->frame.left_out;
      push(*cloud);
      source_.skip(c_.to.every - 1);
      in_ += c_.to.every;
    }
    gaps_.check_any();
    system_.finish([this](const RetargetedFrame& frame) { write(frame); });
    if (!sink_) sink_ = new_sink();
    return out_;
  }
  const Sink& sink() const { return *sink_; }

 private:
  std::optional<SourceCloud> next() {
    const Clock::time_point start = Clock::now();
    auto cloud = source_.next();
    read_ = seconds_since(start);
    return cloud;
  }

  void push(const SourceCloud& cloud) {
    const Clock::time_point start = Clock::now();
    double written = 0;
    const auto show = [&](const RetargetedFrame& frame) {
      const Stopwatch watch(&written);
      write(frame);
    };
    const auto& source = cloud.frame.source;
    const Points& points = cloud.frame.points;
    std::optional<InputError> fault = cloud.fault;
    if (!fault) try {
        door_.pass(points, source, [&] { system_.push(points, source, show); });
      } catch (const UnusableCloud& unusable) {
        fault = unusable;
      }
    if (fault) {
      gaps_.add(in_, *fault);
      system_.miss();
      return;
    }
    gaps_.end();
    out_.sparse.add(points);
    const double work = seconds_since(start);
    const FrameTimes times = system_.times();
    profile_.add({read_, times.extract, times.motion, times.deformation, written, read_ + work});
  }

  void write(const RetargetedFrame& f) {
    if (!sink_) sink_ = new_sink();
    sink_->push(f);
    if (f.filled) out_.filled.push_back(out_.frames);
    ++out_.frames;
    if (!f.confidence) return;
    out_.confidence.push_back(std::round(*f.confidence * 1e3) / 1e3);
    if (!f.filled) out_.sure.push_back(*f.confidence);
    out_.held += *f.confidence < c_.options.min_confidence;
  }

  Sink new_sink() const {
    const Shown shown{system_.target(), system_.rig(),
                      target_.unposed ? &*target_.unposed : nullptr};
    if (caller_.sink) return in_joints(to_, caller_.sink(shown));
    std::optional<SourceRecord> source;
    if (!from_memory_) source = source_.record();  // there is no file to be found again
    return make_sink(to_, shown, source, clip_name(source_.record()), c_.target, target_.own);
  }

  const RetargetCommand& c_;
  const SinkOptions to_;
  const RetargetCaller& caller_;
  Source& source_;
  System& system_;
  const TargetMesh& target_;
  Gaps& gaps_;
  Profile& profile_;
  const bool from_memory_;
  std::optional<Sink> sink_;
  CloudDoor door_;
  Outcome out_;
  int64_t in_ = 0;  // frame of the source
  double read_ = 0;
};

/// What is said when all is done; bad input, which may come late in a source, is answered with one
/// line.
void log_outcome(const std::string& name, const Outcome& done, const Source& source,
                 const Gaps& gaps) {
  for (const std::string& line : source.remarks()) log_warning(line);
  for (const std::string& line : gaps.lines(done.filled)) log_warning(line);
  if (done.points_left_out > 0)
    log_warning(std::to_string(done.points_left_out) +
                " points of the source are NaN or infinite, or more than 5 m from the middle "
                "of the others, and were left out");
  warn_if_unsure(name, done.sure);
  if (!done.sure.empty()) done.sparse.warn(name);
}

Retargeted told(const RetargetCommand& c, const Common& common, const Source& source,
                const Outcome& done, const Gaps& gaps, const Profile& profile) {
  const int64_t frames = c.to.every == 1 ? FrameRate::count(done.frames, c.to.rate()) : done.frames;
  Json document = {{"out", c.to.out},       {"source_frames", source.frames()},
                   {"frames", frames},      {"fps", c.to.rate()},
                   {"seed", common.seed},   {"missing", gaps.json()},
                   {"filled", done.filled}, {"points_left_out", done.points_left_out}};
  if (!done.confidence.empty()) {
    document["held"] = done.held;
    document["confidence"] = done.confidence;
  }
  if (c.profile) document["profile"] = profile.json();
  std::string text = "wrote " + c.to.out + ": " + counted(frames, "frame") + " (seed " +
                     std::to_string(common.seed) + ")";
  if (!done.filled.empty()) text += "; " + std::to_string(done.filled.size()) + " of them filled";
  if (done.held > 0) text += "; in " + std::to_string(done.held) + " of them the target waits";
  return {document, text + "\n"};
}

Source open_source(const RetargetCommand& c, const Common& common, RetargetCaller& caller) {
  SourceRecord how = c.source;
  if (!c.person.empty()) {
    int64_t number = -1;
    if (!text::parse(std::string_view(c.person), number) || number < 0)
      throw InputError("", "--person of clouds is a number from 0", "give one");
    how.person = number;
  }
  if (caller.clouds) return Source(how, std::move(caller.clouds));
  return Source(how, common.max_memory);
}

int run_retarget(const RetargetCommand& c, const Common& common) {
  const Retargeted done = retarget(c, common);
  print(common.json, done.document, done.text);
  return 0;
}

std::string help_of_systems() {
  return joined(
      systems(), [](const SystemType& type) { return type.name + ": " + type.help; }, "; ");
}

}  // namespace

Retargeted retarget(const RetargetCommand& c, const Common& common, RetargetCaller caller) {
  check(c, caller);
  const bool from_memory = caller.clouds != nullptr;
  std::string no_skeleton;
  if (!from_memory && !c.from_surface && has_take(c, &no_skeleton))
    return run_take(c, common, caller);
  if (!c.source_bones.empty() || !c.body_model.empty() || !c.asf.empty() || !c.layout.empty())
    throw InputError(c.source.path, "is looked at as a surface, which has no skeleton",
                     "leave --source-bones, --body-model, --layout and --asf out");
  SystemInput input = load_input(c, common);
  Source source = open_source(c, common, caller);
  if (source.frames() == 0)
    throw InputError(c.source.path, "holds no frames", "give at least one cloud");
  input.options.fps = source.fps();
  // As long as a gap may be that is filled (Gaps), in frames that are pushed.
  input.options.lost_seconds /= static_cast<double>(c.to.every);
  TargetMesh target = read_target(c.target, c.bones);
  check_kept(c, target);
  check_inputs(c, source, target);
  const SinkOptions to = sink_options(c, input, target);
  const auto system = system_for(c, std::move(input), target);
  Gaps gaps(source.frames(), source.fps() / static_cast<double>(c.to.every), c.options.force);
  Profile profile({"read", "extract", "motion", "deformation", "write", "frame"});
  Run run(c, to, source, *system, target, gaps, profile, caller, from_memory);
  // Scripts get one line if the source turns out to be bad later on; people need not wait.
  const bool on_terminal = isatty(STDERR_FILENO) != 0;
  if (on_terminal) say_target(target);
  const Outcome done = run();
  run.sink().commit(done.filled);
  if (!on_terminal) say_target(target);
  if (!no_skeleton.empty())
    log_warning(c.source.path +
                ": its surface is looked at; its skeleton cannot be taken: " + no_skeleton);
  log_outcome(c.source.path, done, source, gaps);
  if (c.profile) log_profile(profile);
  return told(c, common, source, done, gaps, profile);
}

void add_target_options(CommandOptions app, RetargetCommand& c) {
  app.add_option(
         "--target,TARGET", c.target,
         "a glTF or FBX character; or a mesh or cloud of somebody, y up, best in T-pose facing +z")
      .required();
  app.add_option(
      "--bones", c.bones,
      "which bone of a glTF target is which joint, a .yaml file or a known family (default: "
      "found)");
}

void add_animation_options(CommandOptions app, SinkOptions& to) {
  app.add_option("--clip-name", to.clip_name,
                 "of the animation that a rigged target's file gets (default: the source's name)");
  app.add_option("--skeleton", to.skeleton,
                 "names and axes of the bones that a target without a rig gets: restage, smpl, "
                 "mixamo, vrm, unreal (default: restage)");
  app.add_flag("--animation-only", to.animation_only,
               "of a rigged target only nodes and the animation, without meshes");
}

void add_system_options(CommandOptions app, RetargetCommand& c) {
  app.add_option("--device", c.device,
                 "where extractor and motion network run: cpu, or cuda in a program built for it");
  app.add_option("--samples", c.options.samples,
                 "views of a cloud to average: choices of its points, turned and mirrored");
  app.add_option("--anchor", c.options.anchor,
                 "seconds in which the path goes back to the source's, scaled to the target's legs "
                 "(0: never)");
  app.add_option(
      "--min-confidence", c.options.min_confidence,
      "the target waits where the extractor is less sure than this, 0 to 1 (0: never), and "
      "comes back within half a second");
  app.add_flag("!--no-foot-lock", c.options.foot_lock,
               "feet that stand are not held where they landed");
  app.add_option("--floor", c.floor,
                 "on: soles stand on the floor, and no foot goes below it; off (default: on, but "
                 "for X.h5 of a target without bones)")
      .one_of({"on", "off"});
  app.add_option(
         "--contacts", c.contacts,
         "on: arms are moved so that hands touch what the source's hands touch, and go no deeper "
         "into the body; off (default: on, but for X.h5 of a target without bones, and for "
         "arms and trunks like the source's)")
      .one_of({"on", "off"});
  app.add_flag("!--no-keep-limbs", c.options.keep_limbs,
               "legs and arms that cross are named as each frame shows them");
  app.add_flag("!--no-steady-bones", c.options.steady_bones,
               "the source's bones are as long as each frame shows them");
}

void add_live_options(CommandOptions app, RetargetCommand& c) {
  add_target_options(app, c);
  add_weights_options(app, c);
  add_system_options(app, c);
  app.add_flag("--no-online", c.options.late, "weights that can look two frames ahead do so")
      .formerly("--late");
  app.add_option("--fps", c.source.fps, "frames per second of the clouds (default: 30)");
  add_source_up(app, c.source);
  add_scale(app, c.source.scale, "the clouds' units in metres");
  add_force(app, c.options.force, "a target that is no T-pose, clouds in which nobody is found");
}

void add_weights_options(CommandOptions app, RetargetCommand& c) {
  app.add_option("--weights", c.weights,
                 "weights file, run, artifact, standard or lite (default: standard)");
  app.add_option("--system", c.system, help_of_systems());
  app.add_option("--rest", c.rest,
                 "the target's 22 rest joints (HDF5, /joints [1, 22, 3]) (default: found)");
}

void add_retarget(Program& program) {
  auto [app, c] = program.add(
      "retarget", "a target performs the motion of a sequence of clouds",
      "restage retarget scans/ hero.vrm hero_dancing.vrm\n"
      "restage retarget --source scans/ --target hero.vrm --out hero_dancing.vrm\n"
      "restage retarget --source walk.bvh --source-bones mine.yaml --target hero.glb --out "
      "hero_walking.glb\n"
      "restage retarget --source dance.glb --from-surface --target hero.glb --clip-name Dance "
      "--animation-only --out dance.glb\n"
      "restage retarget --source walk_poses.npz --body-model smplh/ --target hero.glb --out-fps 24 "
      "--out hero_walking.glb\n"
      "restage retarget --source wham_output.pkl --person 3 --target hero.glb --out hero_seen.glb\n"
      "restage retarget --source joints.npy --layout h36m17 --fps 50 --target hero.glb --out "
      "a.glb\n"
      "restage retarget --source 02_03.amc --asf 02.asf --target hero.vrm --out hero_running.vrma\n"
      "restage retarget --source scans/ --target hero.obj --skeleton mixamo --out hero.glb\n"
      "restage retarget --source scans.h5 --target hero.ply --weights runs/demo-1 --out result.h5\n"
      "restage retarget --source mm/ --fps 60 --source-up z --scale 0.001 --target a.obj --weights "
      "w "
      "--out a.glb\n"
      "restage retarget --source walk.glb --clip Walk --target hero.vrm --out "
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
      "restage retarget --source s.h5 --target a.ply --out r.h5 --no-steady-bones --no-keep-limbs "
      "--online\n"
      "restage retarget --source s.h5 --target a.ply --out r.h5 --joints smpl --floor on "
      "--contacts on\n"
      "restage retarget --source scans.h5 --target hero.ply --system register --rest rest.h5 "
      "--out r.h5",
      run_retarget);
  add_retarget_options(app, c);
}

void add_retarget_options(CommandOptions app, RetargetCommand& c, bool files) {
  Option source = app.add_option(
      "--source,SOURCE", c.source.path,
      "folder of clouds, file of them (HDF5, NPZ, NPY); or a skeleton's motion, which is taken "
      "over exactly: BVH, AMC, glTF, VRM, VRMA, FBX, AMASS and pose estimators (.npz, .npy, .pkl, "
      ".pt), our motions (.h5)");
  add_target_options(app, c);
  app.add_option("--source-bones", c.source_bones,
                 "the same of a source's skeleton (default: found)");
  app.add_option(
      "--layout", c.layout,
      "of a source of joints without rotations, in which order they are: smpl22, h36m17, "
      "coco17, coco133, mediapipe33, openpose25, kinect25, azure32, humanml263 or another "
      "(default: the one that fits)");
  app.add_option("--asf", c.asf, "of an AMC source its skeleton (default: the one beside)");
  app.add_option("--body-model", c.body_model,
                 "of an AMASS source or a pose estimator's its SMPL model (.npz), or a folder of "
                 "them");
  app.add_option(
      "--person", c.person,
      "of a source that shows several people this one: from 0, or as an estimator's file "
      "calls it; in clouds they are counted from -x to +x in the first frame");
  add_weights_options(app, c);
  app.add_option("--every", c.to.every, "only every so many frames of the source; for X.h5");
  Option out = app.add_option(
      "--out,OUT", c.to.out,
      "X.glb, X.gltf, X.vrm, X.vrma, X.bvh, X.h5, or a folder for PLY or OBJ frames");
  if (files) source.required(), out.required();
  add_animation_options(app, c.to);
  app.add_option("--out-fps", c.to.fps, "frames per second of an animation, such as 24 or 60");
  app.add_option("--joints", c.to.joints,
                 "for X.h5: convert /joints to this definition, smpl or makehuman (default: the "
                 "weights' own)");
  add_source_options(app, c.source);
  app.add_option("--format", c.to.format,
                 "of a folder's frames: ply or obj (default: the target's own, else ply)");
  add_system_options(app, c);
  c.options.late = true;
  app.add_flag(
      "!--online", c.options.late,
      "every frame is answered at once, as in 'restage stream'; else weights that can look "
      "two frames ahead do so");
  add_force(
      app, c.options.force,
      "a target that is no T-pose, clouds in which nobody is found, gaps of over a third of a "
      "second");
  app.add_flag("--from-surface", c.from_surface,
               "look at the surface of a source that has a skeleton, as if it had been scanned");
  app.add_flag("--profile", c.profile,
               "say how long a frame and its parts take: p50, p95, p99, max");
}

}  // namespace restage::cli
