#include "experiments/cli/perform/stream_joints.h"

#include "autograd/base/format.h"
#include "autograd/base/log.h"
#include "datasets/importers/motions/axis.h"
#include "experiments/cli/perform/retarget_words.h"
#include "nn/models/views.h"

namespace restage::cli {
namespace {

constexpr size_t kLearn = 30;  // moments, a second
constexpr int kPatience = 3;   // seconds that cannot be learnt from, in a row

constexpr int kUnreadable = 30;  // lines, after which a sender of nothing else is told

std::string place_of(const live::LiveCloud& line) { return cat(line.name, ":", line.number); }

JointFileOptions file_options(const RetargetCommand& c) {
  JointFileOptions out;
  out.layout = c.layout;
  out.person = c.person;
  return out;
}

MotionOptions motion_options(const RetargetCommand& c) {
  MotionOptions out;
  if (c.source.scale != 1) out.scale = c.source.scale;
  if (c.source.up_known) out.rest.up = parse_axis(c.source.up, "--source-up");
  out.force = c.options.force;
  return out;
}

/// What says how clouds are looked at says nothing of joints.
void check_words(const RetargetCommand& c, const std::string& name) {
  const RetargetOptions usual;
  for (const auto& [given, option] :
       {std::pair(c.options.samples != usual.samples, "--samples"),
        {c.options.anchor != usual.anchor, "--anchor"},
        {c.options.min_confidence != usual.min_confidence, "--min-confidence"},
        {!c.options.foot_lock, "--no-foot-lock"},
        {!c.options.steady_bones, "--no-steady-bones"},
        {!c.options.keep_limbs, "--no-keep-limbs"}})
    if (given)
      throw InputError(name, cat("sends joints, and ", option, " is for clouds"),
                       cat("leave ", option, " out"));
}

}  // namespace

StreamJoints::StreamJoints(const RetargetCommand& c, const TargetMesh& target, const System& system,
                           bool vertices)
    : c_(c), target_(target), system_(system), vertices_(vertices), lines_(file_options(c)) {}

/// What takes time and needs no joints is done before the first second, which nobody waits for.
void StreamJoints::prepare() {
  const Joints& rest = system_.rig()->rest;
  const Mesh& mesh = system_.target();
  const SkinWeights& weights = system_.rig()->weights;
  if (c_.floor == "on") footing_.emplace(Soles(mesh, rest, weights));
  if (c_.contacts == "on") {
    contacts_.emplace(PartSurfaces(mesh, rest, weights));
    theirs_.emplace(average_surfaces());
  }
}

JointLine StreamJoints::read(const live::LiveCloud& line) {
  if (sender_ == 0) {
    check_words(c_, line.name);
    prepare();
  }
  if (line.sender != sender_) forget();
  sender_ = line.sender;
  quiet_ = false;
  try {
    JointLine out = lines_.read(line.line, place_of(line));
    if (!any_) tell_held("lines cannot be read: ");
    any_ = true;
    return out;
  } catch (const InputError& fault) {
    if (!any_ && !fault_) hold(fault);
    if (!any_ && ++unreadable_ == kUnreadable) {
      log_warning(cat("no line can be read: ", fault_->what()));
      held_ = false;
    }
    quiet_ = !any_;
    throw UnusableCloud(fault.where(), fault.cause(), fault.mend());
  }
}

void StreamJoints::hold(const InputError& fault) {
  fault_ = fault;
  held_ = true;
}

/// What can be used has come: the fault before it ends nothing.
void StreamJoints::tell_held(const std::string& what) {
  if (held_) log_warning(what + fault_->what());
  held_ = false;
  fault_.reset();
}

std::optional<RetargetedFrame> StreamJoints::answer(const JointLine& said,
                                                    const live::LiveCloud& line, int64_t missed) {
  quiet_ = false;
  if (!follower_) {
    if (!first_.empty()) first_.resize(first_.size() + static_cast<size_t>(missed));
    first_.push_back(said);
    if (first_.size() < kLearn) return {};
    learn(line.name);
  } else {
    for (int64_t k = 0; k < missed; ++k) follower_->next({});
  }
  if (lines_.names() > names_) follower_->rename(lines_.named());
  names_ = lines_.names();
  std::optional<PosedSkeleton> pose;
  if (!first_.empty())  // its last moment is this one
    pose = follower_->first().back(), first_.clear();
  else
    try {
      pose = follower_->next(lines_.of_person(said, place_of(line)));
    } catch (const InputError& fault) {
      follower_->next({});
      throw UnusableCloud(fault.where(), fault.cause(), fault.mend());
    }
  if (!pose) throw UnusableCloud(place_of(line), lines_.missing(said), "look where the person is");
  if (const double by = follower_->floor_sinks(); by > 0)
    log_info(format("%s: feet stand %.2f m below the floor for a second: the floor goes down",
                    place_of(line).c_str(), by));
  return perform(*pose);
}

/// From the first second. What cannot be used may be somebody who is only coming into sight.
void StreamJoints::learn(const std::string& name) {
  try {
    as_source([&] {
      ImportReport report;
      report.file = name;
      const JointRecording recording = lines_.learn(first_, name);
      follower_.emplace(recording, motion_options(c_), report);
      begin(*follower_, std::move(report));
    });
  } catch (const InputError& fault) {
    follower_.reset();
    first_.clear();
    hold(fault);
    quiet_ = true;
    if (++refused_ == kPatience) throw;
    throw UnusableCloud(fault.where(), fault.cause(), fault.mend());
  }
  refused_ = 0;
  tell_held("the first second could not be used: ");
}

/// Whoever performs stands on the floor on which the source stood in the first second.
void StreamJoints::begin(const JointFollower& follower, ImportReport report) {
  const Joints& rest = system_.rig()->rest;
  take_ = {};
  take_.rest = follower.rest();
  take_.frames = follower.first();
  take_.report = std::move(report);
  stand_on_floor(take_);
  put_on_floor(take_, rest);
  for (const auto& [what, value] : take_.report.facts)
    log_info(take_.report.file + ": " + what + ": " + value);
  for (const std::string& remark : take_.report.remarks)
    log_warning(take_.report.file + ": " + source_words(remark));
}

RetargetedFrame StreamJoints::perform(const PosedSkeleton& source) {
  const Joints& rest = system_.rig()->rest;
  take_.frames.assign(1, source);
  RetargetedFrame out;
  out.pose = perform_take(take_, 0, rest);
  const double scale = leg_length(rest) / std::max(leg_length(take_.rest), 1e-9);
  if (footing_) footing_->settle_feet(rest, source.joints, scale, &out.pose);
  if (contacts_) touch(source, &out.pose);
  out.joints.emplace();
  Points* const vertices = vertices_ ? &out.vertices : nullptr;
  if (target_.own) {
    target_.own->place(out.pose, nullptr, &*out.joints, vertices);
  } else {
    *out.joints = forward_kinematics(rest, out.pose).joints;
    if (vertices_) out.vertices = system_.posed(out.pose);
  }
  return out;
}

/// What hands are moved by follows within some frames, as in a stream of clouds.
void StreamJoints::touch(const PosedSkeleton& source, Pose* pose) {
  constexpr double kFollows = 0.4;  // of the way in a frame
  const Joints& rest = system_.rig()->rest;
  const std::array<Vec3, 2> wanted =
      contacts_->moves({*theirs_, source, leg_length(take_.rest)}, rest, *pose);
  for (size_t side = 0; side < 2; ++side)
    hands_moved_[side] += kFollows * (wanted[side] - hands_moved_[side]);
  move_hands(rest, hands_moved_, pose);
}

void StreamJoints::restart() {
  first_.clear();
  if (follower_) follower_->restart();
  if (footing_) footing_->forget();
  hands_moved_ = {Vec3::Zero(), Vec3::Zero()};
}

void StreamJoints::forget() {
  restart();
  follower_.reset();
  lines_ = JointLines(file_options(c_));
  names_ = 0;
  refused_ = 0;
}

void StreamJoints::finish() const {
  if (follower_ || !fault_) return;
  if (held_) throw *fault_;
  throw InputError("", "no line could be read", "send lines as docs/stream.md says");
}

}  // namespace restage::cli
