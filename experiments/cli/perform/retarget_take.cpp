// restage retarget of a source that has a skeleton: BVH, AMC, glTF, VRM animations, AMASS, motions.
#include <filesystem>

#include "autograd/base/log.h"
#include "datasets/benchmark/floor.h"
#include "datasets/doctor/examine.h"
#include "datasets/importers/joints/joint_file.h"
#include "datasets/importers/motions/estimated.h"
#include "datasets/importers/motions/skeleton_take.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"
#include "experiments/cli/output.h"
#include "experiments/cli/perform/retarget.h"
#include "experiments/cli/perform/retarget_words.h"
#include "experiments/text.h"
#include "infer/contacts.h"
#include "infer/footing.h"
#include "infer/frame_rate.h"

namespace restage::cli {
namespace {

/// What says how clouds are looked at says nothing of a skeleton.
void check_words(const RetargetCommand& c) {
  const RetargetOptions usual;
  const auto refuse = [&](const std::string& option) {
    throw InputError(c.source.path,
                     "has a skeleton, which is taken over as it is; " + option + " is for clouds",
                     "leave " + option + " out, or add --from-surface");
  };
  const bool many = text::ends_in(c.source.path, {".h5", ".hdf5"});
  if (c.source.fps && !(*c.source.fps >= 1 && *c.source.fps <= 2000))
    throw InputError("", "--fps is out of range", "give the source's frames per second, 1 to 2000");
  if (!(c.source.scale >= 1e-9 && c.source.scale <= 1e9))
    throw InputError("", "--scale is out of range", "give metres per unit of the source");
  if (c.source.sequence && !many) refuse("--sequence");
  if (c.system != "chain") refuse("--system");
  if (c.options.samples != usual.samples) refuse("--samples");
  if (c.options.anchor != usual.anchor) refuse("--anchor");
  if (c.options.min_confidence != usual.min_confidence) refuse("--min-confidence");
  if (!c.options.foot_lock) refuse("--no-foot-lock");
  if (!c.options.steady_bones) refuse("--no-steady-bones");
  if (!c.options.late) refuse("--online");
  if (!c.options.keep_limbs) refuse("--no-keep-limbs");
  if (c.profile) refuse("--profile");
  const bool parameters = may_hold_estimates(c.source.path);
  if (!c.body_model.empty() && !parameters)
    throw InputError(c.source.path, "has a skeleton of its own", "leave --body-model out");
  std::error_code ignored;
  if (!c.person.empty() && !parameters && !may_hold_joints(c.source.path) &&
      !std::filesystem::is_directory(c.source.path, ignored))
    throw InputError(c.source.path, "has one skeleton", "leave --person out");
  if (!c.asf.empty() && !text::ends_in(c.source.path, {".amc", ".amc.xz"}))
    throw InputError(c.source.path, "has a skeleton of its own", "leave --asf out");
  if (many && c.source.fps && *c.source.fps != kFps)
    throw InputError(c.source.path, "has 30 frames a second, which --fps cannot change",
                     "leave --fps out");
  if (is_gltf_name(c.source.path) && c.source.fps && *c.source.fps != kFps)
    throw InputError(c.source.path, "states its key times, which --fps cannot change",
                     "leave --fps out");
}

/// Where source and target have skeletons, what says how networks answer says nothing.
void check_no_network(const RetargetCommand& c) {
  for (const auto& [given, option] : {std::pair(!c.weights.empty(), "--weights"),
                                      {!c.rest.empty(), "--rest"},
                                      {c.device != "cpu", "--device"}})
    if (given)
      throw InputError(c.source.path,
                       cat("has a skeleton as the target has, so no network is asked; ", option,
                           " is for networks"),
                       cat("leave ", option, " out, or add --from-surface"));
}

TakeOptions options_of(const RetargetCommand& c, const Joints& performer) {
  TakeOptions out;
  if (c.source.scale != 1) out.motion.scale = c.source.scale;
  if (c.source.up_known) out.motion.rest.up = parse_axis(c.source.up, "--source-up");
  if (c.source.fps) out.motion.fps = *c.source.fps;
  out.motion.force = c.options.force;
  out.motion.profile = c.source_bones;
  out.motion.fingers = true;
  out.motion.layout = c.layout;
  out.clip = c.source.clip;
  out.sequence = c.source.sequence;
  out.body_model = c.body_model;
  out.person = c.person;
  out.asf = c.asf;
  out.like = performer;
  return out;
}

/// How far the bones at these joints are from being the source's, scaled; of the leg.
double unlike(const SkeletonTake& take, const Joints& rest, const std::vector<size_t>& joints) {
  const double scale = leg_length(rest) / std::max(leg_length(take.rest), 1e-9);
  double out = 0;
  for (const size_t j : joints) {
    const auto from_pelvis = [&](const Joints& x) { return Vec3(x[j] - x[kPelvis]); };
    out = std::max(out, (from_pelvis(rest) - scale * from_pelvis(take.rest)).norm());
  }
  return out / std::max(leg_length(rest), 1e-9);
}
constexpr double kSame = 0.01;

/// Keeps the feet of a target on the floor that performs another's motion: before a foot would go
/// below it, the foot is raised, and later let down; one that floats while the source's is near the
/// floor is lowered. What a knee cannot give, the pelvis does.
class Floor {
 public:
  Floor(const SkeletonTake& take, const Shown& shown)
      : take_(take),
        rest_(shown.rig->rest),
        scale_(leg_length(rest_) / std::max(leg_length(take.rest), 1e-9)),
        soles_(shown.target, rest_, shown.rig->weights) {}

  /// Somebody with the source's own legs does exactly what the source does, whatever that is.
  bool is_needed() const { return unlike(take_, rest_, {1, 2, 4, 5, 7, 8, 10, 11}) > kSame; }

  /// Looks at the whole take.
  void prepare() {
    const FlatFoot flat = flat_foot(take_.rest);
    std::array<std::vector<double>, 2> lifts, drops;
    std::vector<double> raised;
    for (size_t f = 0; f < take_.frames.size(); ++f) {
      const Pose pose = perform_take(take_, f, rest_);
      const auto deep =
          depths(least_heights(take_.frames[f].joints, flat, scale_), soles_, rest_, pose);
      const auto high = floating(take_.frames[f].joints, flat, scale_, soles_, rest_, pose);
      raised.push_back(0);
      for (int side = 0; side < 2; ++side) {
        const double by = deep[static_cast<size_t>(side)], most = most_lift(rest_, side, pose);
        lifts[static_cast<size_t>(side)].push_back(std::min(by, most));
        drops[static_cast<size_t>(side)].push_back(
            std::min(high[static_cast<size_t>(side)], most_drop(rest_, side, pose)));
        raised.back() = std::max(raised.back(), by - most);
      }
    }
    raised_ = smooth_over(std::move(raised));
    for (size_t side = 0; side < 2; ++side) {
      lifts_[side] = smooth_over(std::move(lifts[side]));
      const std::vector<double> drop = lower_envelope(drops[side], kHalf);
      for (size_t f = 0; f < drop.size(); ++f) lifts_[side][f] -= std::max(0.0, drop[f]);
    }
  }

  void operator()(size_t frame, Pose* pose) const {
    pose->root.y() += raised_[frame];
    std::array<double, 2> by;
    for (size_t side = 0; side < 2; ++side) {
      const double lift = lifts_[side][frame];
      by[side] = lift > 0 ? std::max(0.0, lift - raised_[frame]) : lift - raised_[frame];
    }
    raise_feet(by, rest_, pose);
  }

 private:
  static constexpr size_t kHalf = 2;  // frames

  /// A smooth curve on or above the values.
  static std::vector<double> smooth_over(std::vector<double> values) {
    for (double& x : values) x = -x;
    std::vector<double> out = lower_envelope(values, kHalf);
    for (double& x : out) x = -x;
    return out;
  }

  const SkeletonTake& take_;
  const Joints& rest_;
  double scale_;
  Soles soles_;
  std::array<std::vector<double>, 2> lifts_;
  std::vector<double> raised_;
};

/// Hands that touch what the source's touch.
class Hands {
 public:
  Hands(const SkeletonTake& take, const Shown& shown)
      : take_(take),
        rest_(shown.rig->rest),
        contacts_(PartSurfaces(shown.target, rest_, shown.rig->weights)),
        theirs_(take.figure
                    ? PartSurfaces(take.figure->mesh(), take.figure->rest(), take.figure->weights())
                    : average_surfaces()),
        size_(take.figure ? 1 : leg_length(take.rest)) {}

  /// Somebody with the source's own trunk and arms does exactly what the source does.
  bool is_needed() const {
    return unlike(take_, rest_, {3, 6, 9, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21}) > kSame;
  }

  /// Looks at the whole take: `poses`, one a frame. What moves the hands begins and ends within
  /// some frames before and after a touch.
  void prepare(const std::vector<Pose>& poses) {
    std::vector<std::array<Vec3, 2>> exact;
    for (size_t f = 0; f < poses.size(); ++f)
      exact.push_back(contacts_.moves({theirs_, take_.frames[f], size_}, rest_, poses[f]));
    moves_ = smoothed(exact);
    for (size_t f = 0; f < poses.size(); ++f) exact[f] = elbows_moved(rest_, moves_[f], poses[f]);
    elbows_ = smoothed(exact);
  }

  void operator()(size_t frame, Pose* pose) const {
    move_hands(rest_, moves_[frame], elbows_[frame], pose);
  }

 private:
  /// A bell over the frames around.
  static std::vector<std::array<Vec3, 2>> smoothed(const std::vector<std::array<Vec3, 2>>& exact) {
    constexpr int kWidth = 2, kReach = 3 * kWidth;  // frames
    std::vector<std::array<Vec3, 2>> out(exact.size(), {Vec3::Zero(), Vec3::Zero()});
    for (size_t f = 0; f < exact.size(); ++f) {
      double all = 0;
      for (int k = -kReach; k <= kReach; ++k) {
        const auto at = static_cast<std::ptrdiff_t>(f) + k;
        if (at < 0 || at >= std::ssize(exact)) continue;
        const double weight = std::exp(-0.5 * k * k / (kWidth * kWidth));
        all += weight;
        for (size_t side = 0; side < 2; ++side)
          out[f][side] += weight * exact[static_cast<size_t>(at)][side];
      }
      for (Vec3& by : out[f]) by /= all;
    }
    return out;
  }

  const SkeletonTake& take_;
  const Joints& rest_;
  Contacts contacts_;
  PartSurfaces theirs_;
  double size_;
  std::vector<std::array<Vec3, 2>> moves_, elbows_;
};

}  // namespace

bool has_take(const RetargetCommand& c, std::string* why) {
  return as_source([&] { return holds_take(c.source.path, c.source_bones, why, c.layout); });
}

Retargeted run_take(const RetargetCommand& c, const Common& common, const RetargetCaller& caller) {
  check_words(c);
  TargetMesh target = read_target(c.target, c.bones);
  check_kept(c, target);
  if (target.own) check_no_network(c);
  SystemInput input;
  if (!target.own) {
    check_mesh(c, target);
    input = load_input(c, common);
  }
  const SinkOptions to = sink_options(c, input, target);
  std::unique_ptr<System> system;  // poses a target that has no rig of its own
  if (!target.own) system = system_for(c, std::move(input), target);
  SkinWeights weights;
  if (target.own) weights = target.own->weights();
  const Joints& rest = target.own ? target.own->rest() : *system->target_joints();
  SkeletonTake take = as_source([&] { return read_take(c.source.path, options_of(c, rest)); });
  for (std::string& remark : take.report.remarks) remark = source_words(std::move(remark));
  put_on_floor(take, rest);
  std::optional<SystemRig> rig;
  if (target.own) rig.emplace(SystemRig{rest, weights});
  const Shown shown{target.own ? target.own->mesh() : system->target(),
                    target.own ? &*rig : system->rig(),
                    target.unposed ? &*target.unposed : nullptr};
  std::optional<SourceRecord> source;
  if (is_gltf_name(c.source.path)) source = c.source;
  const Sink sink = caller.sink ? in_joints(to, caller.sink(shown))
                                : make_sink(to, shown, source, take.name, c.target, target.own);
  say_take(take);
  say_target(target);
  std::optional<Floor> floor;
  if (is_on(c.floor, c, target) && shown.rig != nullptr) floor.emplace(take, shown);
  if (floor && c.floor.empty() && !floor->is_needed()) floor.reset();
  if (floor) floor->prepare();
  std::optional<Hands> hands;
  if (is_on(c.contacts, c, target) && shown.rig != nullptr) hands.emplace(take, shown);
  if (hands && c.contacts.empty() && !hands->is_needed()) hands.reset();
  std::vector<Pose> poses;
  for (size_t f = 0; f < take.frames.size(); ++f) {
    poses.push_back(perform_take(take, f, rest));
    if (floor) (*floor)(f, &poses.back());
  }
  if (hands) hands->prepare(poses);
  int64_t frames = 0;
  for (size_t f = 0; f < take.frames.size(); f += static_cast<size_t>(c.to.every)) {
    caller.look();
    RetargetedFrame frame;
    frame.pose = poses[f];
    if (hands) (*hands)(f, &frame.pose);
    frame.joints.emplace();
    if (!take.fingers.empty()) frame.fingers = take.fingers[f];
    if (target.own) {
      target.own->place(frame.pose, frame.fingers ? &*frame.fingers : nullptr, &*frame.joints,
                        &frame.vertices);
    } else {
      *frame.joints = forward_kinematics(rest, frame.pose).joints;
      frame.vertices = system->posed(frame.pose);
    }
    sink.push(frame);
    ++frames;
  }
  sink.commit({});
  if (c.to.every == 1) frames = FrameRate::count(frames, c.to.rate());
  const Json document = {{"out", c.to.out},   {"source_frames", take.frames.size()},
                         {"frames", frames},  {"fps", c.to.rate()},
                         {"clip", take.name}, {"from", "skeleton"}};
  return {document, "wrote " + c.to.out + ": " + counted(frames, "frame") +
                        ", the motion of the source's skeleton\n"};
}

}  // namespace restage::cli
