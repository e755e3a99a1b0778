#include "infer/retargeter.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "autograd/base/format.h"
#include "autograd/kernels/rotation.h"
#include "autograd/ops/layout.h"

namespace restage {
namespace {

constexpr int kTargetSamples = 16;  // views of the target, more than of a frame: it is seen once
constexpr size_t kTargetPoints = 8192;
constexpr double kTposeLimit = 30.0;  // degrees
constexpr double kClear = 0.5;        // confidence of a frame in which all can be made out
constexpr double kRemembering = 8;  // frames per second; at lower rates a frame tells too little of
                                    // the next one, and the extractor is not told

Tensor tensor_of(const Joints& joints, const Vec3& origin) {
  Tensor t = Tensor::empty({1, kJoints, 3});
  for (size_t j = 0; j < kJoints; ++j)
    for (int c = 0; c < 3; ++c)
      t.data<float>()[3 * j + static_cast<size_t>(c)] =
          static_cast<float>(joints[j][c] - origin[c]);
  return t;
}

/// A at a moment between two, `t` of the way from `a` to `b`: positions are interpolated; rotations
/// and uncertainty are copied from the nearer of both.
SeenJoints blend(const SeenJoints& a, const SeenJoints& b, double t) {
  SeenJoints out = t < 0.5 ? a : b;
  for (size_t j = 0; j < kJoints; ++j) out.joints[j] = (1 - t) * a.joints[j] + t * b.joints[j];
  return out;
}

/// The motion network's input: A relative to A's pelvis, turned by `turn`. `moved`: the pelvis's
/// velocity or place, as the network was trained. `reframed`: the turn from the frame before's
/// directions to this frame's. `rest`: B's rest joints.
MotionInput input_of(const SeenJoints& seen, const Mat3& turn, const Vec3& moved,
                     const Mat3& reframed, const Tensor& rest) {
  SeenJoints local = turned(turn, seen);
  const auto number = [](const Shape& shape) { return Tensor::empty(shape); };
  MotionInput out{Var(tensor_of(local.joints, local.joints[0]).reshape({1, 1, kJoints, 3})),
                  Var(number({1, 1, 3})),
                  Var(rest),
                  {},
                  {}};
  Eigen::Map<Point>(out.trans.value.data<float>()) = moved.cast<float>();
  out.reframed = number({1, 1, 3, 3});
  matrix_at(out.reframed.data<float>()) = reframed.cast<float>();
  if (local.turns) {
    out.turns = number({1, 1, kJoints, 3, 3});
    for (size_t j = 0; j < kJoints; ++j)
      matrix_at(out.turns.data<float>() + 9 * j) = (*local.turns)[j].cast<float>();
  }
  if (local.uncertainty) {
    out.uncertainty = number({1, 1, kJoints});
    for (size_t j = 0; j < kJoints; ++j)
      out.uncertainty.data<float>()[j] = static_cast<float>((*local.uncertainty)[j]);
  }
  return out;
}

bool is_clear(const SeenJoints& seen) {
  return !seen.uncertainty || confidence(*seen.uncertainty) >= kClear;
}

/// The centre about which A's path is scaled to B's: the origin if A starts near the origin. If A
/// starts far away, the centre is a place on the floor kNear metres from A. The scale still changes
/// in the first frames, as the estimate of A's legs does; far from the centre, small changes would
/// move B by much.
Vec3 scaling_centre(const Vec3& start) {
  constexpr double kNear = 3;  // metres
  const double far = std::hypot(start[0], start[2]);
  return far <= kNear ? Vec3(0, 0, 0) : Vec3((1 - kNear / far) * Vec3(start[0], 0, start[2]));
}

/// What is wrong with joints that are not in T-pose; empty if they are.
std::string off_tpose(const Joints& j) {
  for (const auto& [shoulder, wrist, side] :
       {std::tuple<size_t, size_t, double>{16, 20, 1.0}, {17, 21, -1.0}}) {
    const Vec3 arm = j[wrist] - j[shoulder];
    const double angle =
        std::acos(std::clamp(side * arm[0] / std::max(arm.norm(), 1e-9), -1.0, 1.0)) * 180 / M_PI;
    if (angle <= kTposeLimit) continue;
    return format("is not in T-pose: the %s arm is %.0f degrees from %sx",
                  side > 0 ? "left" : "right", angle, side > 0 ? "+" : "-");
  }
  return "";
}

}  // namespace

Retargeter::Retargeter(const Bundle& weights, const std::string& weights_name, Mesh target,
                       const std::string& where, const RetargetOptions& options)
    : models_(weights), target_(std::move(target)), options_(options) {
  auto& skeleton = models_.need_as<SkeletonModel>("skeleton", weights_name);
  const RngKey key = RngKey{options.seed, 0}.fold("target");
  rest_ = extract_joints(
      skeleton, surface_points(target_, kTargetPoints, key.fold("surface")), where, key,
      {.samples = kTargetSamples, .around = kRestPoses, .any_size = options.any_size});
  if (const std::string off = off_tpose(rest_); !off.empty() && !options.force)
    throw InputError(where, off + ", as these weights see it",
                     "give the target in T-pose facing +z, y up, or add {force}");
  prepare(weights_name);
}

Retargeter::Retargeter(const Bundle& weights, const std::string& weights_name, Mesh target,
                       const Joints& rest, const RetargetOptions& options)
    : models_(weights), target_(std::move(target)), options_(options), rest_(rest) {
  prepare(weights_name);
}

void Retargeter::prepare(const std::string& weights_name) {
  if (!(options_.fps >= 1 && options_.fps <= 1000))
    throw InputError("", "the source's frames per second are out of range",
                     "give {fps} from 1 to 1000");
  if (!(options_.anchor >= 0))
    throw InputError("", "the anchor's time is out of range", "give {anchor} 0 or more seconds");
  if (!(options_.min_confidence >= 0 && options_.min_confidence <= 1))
    throw InputError("", "the least confidence is out of range", "give {min-confidence} 0 to 1");
  if (auto* skeleton = models_.find_as<SkeletonModel>("skeleton"))
    extractor_.emplace(*skeleton, LookOptions{.samples = options_.samples,
                                              .keep_limbs = options_.keep_limbs,
                                              .any_size = options_.any_size,
                                              .any_way_up = options_.any_way_up});
  const std::string role =
      options_.late && models_.find(kLateMotion) != nullptr ? kLateMotion : "motion";
  const TrainedModel& motion = models_.need(role, weights_name);
  auto& network = models_.need_as<MotionModel>(role, weights_name);
  motion_ = &network;
  motion_device_ = device_of(network);
  asked_.resize(static_cast<size_t>(motion_->latency()) + 1);
  const std::string translation =
      motion.setting("translation", {"velocity", "relative", "absolute"});
  path_ = translation == "velocity"   ? Path::velocity
          : translation == "relative" ? Path::relative
                                      : Path::absolute;
  remove_heading_ = motion.setting("remove_heading", {"false", "true"}) == "true";
  steady_heading_ = motion.setting("steady_heading", {"false", "true"}) == "true";
  heading_ = Heading(steady_heading_);
  rest_tensor_ = tensor_of(rest_, rest_[0]);
  if (models_.find("deformation.weights") != nullptr)
    surface_.emplace(models_, weights_name, target_, rest_, motion_device_);
  if (surface_) system_rig_.emplace(SystemRig{rest_, surface_->weights()});
}

bool Retargeter::frame_by_frame() const { return options_.fps == kFps && motion_->latency() == 0; }

void Retargeter::forget() {
  state_ = {};
  feet_ = {};
  if (footing_) footing_->forget();
  hands_moved_.fill(Vec3::Zero());
  bones_ = {};
  waiting_ = {};
  heading_ = Heading(steady_heading_);
  previous_.reset();
  back_before_.reset();
  received_.reset();
  grid_ = answered_ = begun_ = 0;
  clear_start_ = true;
  legs_a_ = 0;
}

void Retargeter::answer(const Points& cloud, const std::string& source, const Show& show) {
  const RngKey key = RngKey{options_.seed, 0}.fold("frame").fold(static_cast<uint64_t>(frames()));
  SeenJoints seen;
  {
    const Stopwatch watch(&times_.extract);
    if (!extractor_)
      throw InputError(source, "cannot be read without a model for skeleton",
                       "give weights that have one");
    const bool remembers =
        received_ && options_.fps / static_cast<double>(missed() + 1) > kRemembering;
    seen = (*extractor_)(cloud, source, key, remembers ? &*received_ : nullptr);
    if (!options_.force) check_not_lost(seen, source);
    if (!clear_start_ && is_clear(seen)) bones_ = {};  // B begins once more
    if (options_.steady_bones) seen.joints = bones_(seen.joints, seen.uncertainty);
  }
  answer_joints(seen, show);
}

std::string lost(const SeenJoints& now, const SeenJoints& before, double seconds) {
  constexpr double kLost = 0.25;                  // docs/decisions.md, "Doctor and real scans"
  constexpr double kTurned = 30, kTurning = 600;  // degrees, and degrees a second
  if (!now.uncertainty || !before.uncertainty || confidence(*before.uncertainty) < kClear)
    return "";
  if (confidence(*now.uncertainty) < kLost)
    return format("shows nobody who can be made out (confidence %.2f)",
                  confidence(*now.uncertainty));
  const double turned = trunk_turn(now.joints, before.joints) * 180 / M_PI;
  if (turned < kTurned + kTurning * seconds) return "";
  return format("shows a trunk that turned by %.0f degrees in %.2f s", turned, seconds);
}

/// A frame in which nobody can be made out, soon after one in which everything was clear, is a
/// fault of the source (another unit, another axis up, another thing). B would be thrown about for
/// it, and the memory of it would spoil the frames after it (RetargetOptions::lost_seconds).
void Retargeter::check_not_lost(const SeenJoints& seen, const std::string& source) const {
  const double seconds = static_cast<double>(missed() + 1) / options_.fps;
  if (!received_ || seconds > options_.lost_seconds + 1e-9) return;
  if (const std::string fault = lost(seen, *received_, seconds); !fault.empty())
    throw UnusableCloud(source, fault + ", unlike the frames before",
                        "give all frames in one unit and with one axis up, leave this one out, or "
                        "{force} to take it as it is");
}

void Retargeter::push_joints(const SeenJoints& seen, const Show& show) {
  take([&] { answer_joints(seen, show); });
}

void Retargeter::answer_joints(const SeenJoints& seen, const Show& show) {
  last_source_ = seen.joints;
  advance(seen, frames(), false, show);
  received_ = seen;
}

/// Answers all moments of the grid up to the moment of the source's frame `frame`. `seen`: A in
/// that frame. Between two frames of the source that were received, A's positions are interpolated.
/// `ended`: the source ended with missed frames; `seen` is then A in the last frame that was
/// received, and A stays so.
void Retargeter::advance(const SeenJoints& seen, int64_t frame, bool ended, const Show& show) {
  const double now = static_cast<double>(frame) / options_.fps;
  const auto apart = static_cast<double>(missed() + 1);  // source frames from received_ to `seen`
  while (static_cast<double>(grid_) / kFps <= now + 1e-9) {
    const double back =
        (now - static_cast<double>(grid_) / kFps) * options_.fps;  // in source frames
    const bool between = back > 1e-9 && !ended;
    step(received_ && between ? blend(seen, *received_, std::min(back / apart, 1.0)) : seen,
         missed() > 0 && (between || ended), show);
  }
}

void Retargeter::answer_rest(const Show& show) {
  if (missed() > 0) advance(*received_, frames() - 1, true, show);
  const SeenJoints last = asked_[static_cast<size_t>((grid_ - 1) % std::ssize(asked_))].seen;
  for (const int64_t all = grid_; answered_ < all;) step(last, false, show);
}

/// Tells the motion network of one moment of the grid, and shows the frame that the network
/// answers, if there is one: the frame of this moment, or of an earlier one.
void Retargeter::step(const SeenJoints& now, bool filled, const Show& show) {
  SeenJoints seen = now;
  {
    const Stopwatch watch(&times_.motion);
    const double heading = remove_heading_ ? heading_(now.joints) : 0;
    const MotionOutput said = ask(now, turn_about_y(heading));
    const int64_t room = std::ssize(asked_);
    asked_[static_cast<size_t>(grid_ % room)] = {now, turn_about_y(heading), filled};
    if (++grid_ < room) return;
    const Asked& then = asked_[static_cast<size_t>(grid_ % room)];  // the oldest
    seen = then.seen;
    frame_.filled = then.filled;
    perform(said, seen.joints, then.turn, &frame_.pose);
    if (options_.contacts) keep_contacts(seen);
  }
  frame_.confidence.reset();
  if (seen.uncertainty) frame_.confidence = frame_.filled ? 0 : confidence(*seen.uncertainty);
  hold_doubtful(seen.joints);
  adjust(frame_);
  hand_out(frame_, show);
}

void Retargeter::place(RetargetedFrame& frame) const {
  const PosedSkeleton posed = forward_kinematics(rest_, frame.pose);
  frame.joints = posed.joints;
  if (surface_) (*surface_)(frame.pose, posed, &frame.vertices);
}

/// A's rotations are taken for B's. A hand whose place is not known to a few centimetres touches
/// nothing. What hands are moved by follows within some frames: joints that are seen tremble.
void Retargeter::keep_contacts(const SeenJoints& a) {
  constexpr double kSure = 0.025, kUnsure = 0.06;  // metres
  constexpr double kFollows = 0.4;                 // of the way in a frame
  if (!contacts_ && rig() != nullptr)
    contacts_.emplace(PartSurfaces(target_, rig()->rest, rig()->weights));
  if (!contacts_) return;
  std::array<double, 2> sure{1, 1};
  if (a.uncertainty)
    for (size_t side = 0; side < 2; ++side)
      sure[side] =
          std::clamp((kUnsure - (*a.uncertainty)[kLeftWrist + side]) / (kUnsure - kSure), 0.0, 1.0);
  PosedSkeleton seen = forward_kinematics(rest_, frame_.pose);
  seen.joints = a.joints;
  const std::array<Vec3, 2> wanted =
      contacts_->moves({*options_.contacts, seen, leg_length(a.joints)}, rest_, frame_.pose, sure);
  for (size_t side = 0; side < 2; ++side)
    hands_moved_[side] += kFollows * (wanted[side] - hands_moved_[side]);
  move_hands(rest_, hands_moved_, &frame_.pose);
}

/// Lets B wait in a frame without confidence (RetargetOptions::min_confidence). `a`: A's joints in
/// that frame.
void Retargeter::hold_doubtful(const Joints& a) {
  if (!frame_.confidence && options_.min_confidence > 0)
    throw InputError("", "these weights do not say how sure they are of a frame",
                     "leave {min-confidence} out, or give weights whose extractor has sizes."
                     "uncertainty");
  if (options_.min_confidence == 0) return;
  if (*frame_.confidence >= options_.min_confidence) {
    frame_.pose = waiting_.go_on(frame_.pose);
    return;
  }
  Pose rest = frame_.pose;
  rest.local.fill(Mat3::Identity());
  rest.local[0] = turn_about_y(heading_angle(a));
  frame_.pose = waiting_.wait(rest);
}

/// Puts B where A begins, in proportion to the length of B's legs.
/// B begins in the first frame of the sequence.
/// If A could not be made out in that frame, B begins once more, in the first clear frame: half of
/// somebody, or another thing, is no place to start from.
void Retargeter::begin(const SeenJoints& seen) {
  const bool clear = is_clear(seen);
  if (previous_ && (clear_start_ || !clear)) return;
  const Joints& a = seen.joints;
  const double scale = leg_length(rest_) / std::max(leg_length(a), 1e-6);
  start_a_ = a[0];
  root_b_ = start_b_ = scale * a[0];
  centre_a_ = scaling_centre(a[0]);
  centre_b_ = scale * centre_a_;
  if (previous_) {  // once more
    previous_.reset();
    back_before_.reset();
    feet_ = {};
    if (footing_) footing_->forget();
    begun_ = grid_;
  }
  clear_start_ = clear;
}

/// The motion network's answer to A as `seen`. `turn`: A's heading.
MotionOutput Retargeter::ask(const SeenJoints& seen, const Mat3& turn) {
  const Joints& a = seen.joints;
  const Mat3 back = turn.transpose();
  begin(seen);
  const Vec3 before = path_ == Path::velocity   ? (previous_ ? (*previous_)[0] : a[0])
                      : path_ == Path::relative ? start_a_
                                                : Vec3(Vec3::Zero());
  const Vec3 moved = (path_ == Path::velocity ? kFps : 1.0) * (back * (a[0] - before));
  previous_ = a;
  Context ctx;
  const Mat3 reframed = back * back_before_.value_or(back).transpose();
  back_before_ = back;
  const MotionInput in = input_of(seen, back, moved, reframed, rest_tensor_);
  return on_host(motion_->forward(ctx, restage::moved(in, motion_device_), &state_));
}

/// Makes B's pose of the motion network's answer. `a` and `turn`: A's joints and heading in the
/// frame that is answered.
void Retargeter::perform(const MotionOutput& answer, const Joints& a, const Mat3& turn,
                         Pose* pose) {
  ++answered_;
  const float* r = answer.rotations.value.data<float>();
  for (size_t j = 0; j < kJoints; ++j) pose->local[j] = matrix_at(r + 9 * j).cast<double>();
  pose->local[0] = turn * pose->local[0];
  const float* t = answer.trans.value.data<float>();
  const Vec3 t_b = turn * Vec3(t[0], t[1], t[2]);
  if (path_ == Path::velocity)
    sum_path(a, t_b);
  else
    root_b_ = path_ == Path::relative ? Vec3(start_b_ + t_b) : t_b;
  pose->root = root_b_;
  if (answer.standing.value.defined()) stand(answer.standing.value.data<float>(), a, pose);
}

/// Puts B's feet on the floor and holds those that stand. `logits`: of the chances that the left
/// and the right foot stand.
void Retargeter::stand(const float* logits, const Joints& a, Pose* pose) {
  std::array<double, 2> standing{};
  for (size_t side = 0; side < 2; ++side)
    standing[side] = 1 / (1 + std::exp(-static_cast<double>(logits[side])));
  if (options_.floor && !footing_ && rig() != nullptr)
    footing_.emplace(Soles(target_, rig()->rest, rig()->weights));
  const double scale = leg_length(rest_) / std::max(leg_length(a), 1e-6);
  std::optional<std::array<double, 2>> above;
  if (footing_) above = (*footing_)(rest_, a, scale, standing, pose);
  if (options_.foot_lock) feet_(rest_, standing, pose, above);
  if (footing_) footing_->settle_feet(rest_, a, scale, pose);
}

/// Moves B's pelvis on by `velocity`, metres a second, and draws it to A's scaled path
/// (RetargetOptions::anchor): errors of the velocity would carry B ever further away.
void Retargeter::sum_path(const Joints& a, const Vec3& velocity) {
  const int64_t since = answered_ - begun_;  // frames since B began, this one too
  if (since < 1) return;                     // shown where B will begin
  legs_a_ += (leg_length(a) - legs_a_) / static_cast<double>(since);
  if (since == 1) return;
  root_b_ += velocity / kFps;
  if (!(options_.anchor > 0)) return;
  const double scale = leg_length(rest_) / std::max(legs_a_, 1e-6);
  const Vec3 wanted = centre_b_ + scale * (a[0] - centre_a_);
  root_b_ += (1 - std::exp(-1 / (kFps * options_.anchor))) * (wanted - root_b_);
}

}  // namespace restage
