#include "datasets/importers/joints/follow.h"

#include <algorithm>
#include <cmath>

#include "datasets/importers/joints/frame_solver.h"
#include "datasets/importers/joints/learnt_body.h"
#include "datasets/importers/joints/skeleton_of.h"
#include "datasets/importers/motions/rest_pose.h"
#include "datasets/readers/errors.h"

namespace restage {

using namespace joints_detail;

namespace {

constexpr size_t kTurnsAveraged = 3;  // frames
constexpr int kLongestHold = 15;      // frames that a limb's joint may be missing
constexpr size_t kLongestAgo = 8;     // of kMoments

Vec3 middle_of_hips(const SeenFrame& x) { return 0.5 * (*x[kLeftHip] + *x[kRightHip]); }

/// One-sided bell: the weight of what was `ago` frames ago.
double weight_of(size_t ago, double sigma) {
  const auto k = static_cast<double>(ago);
  return std::exp(-0.5 * k * k / (sigma * sigma));
}

PosedSkeleton lowered(PosedSkeleton pose, double by) {
  for (Vec3& x : pose.joints) x.y() -= by;
  return pose;
}

}  // namespace

JointFollower::JointFollower(const JointRecording& first, const MotionOptions& options,
                             ImportReport& report)
    : layout_(first.layout) {
  JointRecording at_our_rate = first;
  at_our_rate.fps = kFps;
  const LearntBody body = learn_body(at_our_rate, options, report);
  std::erase_if(report.facts, [](const auto& fact) { return fact.first == "frame rate"; });
  from_ = body.joints.from;
  sigma_ = body.joints.sigma;
  noise_ = body.noise;
  rest_ = body.rest;
  for (const FileFrame& frame : first.frames)
    if (const auto pose = solve(frame)) first_.push_back(*pose);
  if (first_.empty())
    throw InputError(report.file, "shows no trunk: both hips and both shoulders at once",
                     "give a tracker's joints of the whole trunk");
  std::vector<double> lowest;
  for (const PosedSkeleton& pose : first_) lowest.push_back(lowest_foot(pose));
  floor_ = lower_ = floor_height(lowest);
  if (in_place())
    report.remark(
        "the hips do not move: the joints do not say where the person is. The motion stays in "
        "place and stands on the lower foot, until the hips move");
  for (size_t f = 0; f < first_.size(); ++f)
    first_[f] = lowered(std::move(first_[f]), in_place() ? lowest[f] : floor_);
}

std::optional<PosedSkeleton> JointFollower::next(const FileFrame& frame) {
  std::optional<PosedSkeleton> out = solve(frame);
  sinks_ = 0;
  if (out && !in_place()) look_at_floor(lowest_foot(*out));
  if (out) out = lowered(std::move(*out), in_place() ? lowest_foot(*out) : floor_);
  return out;
}

void JointFollower::restart() {
  places_.clear();
  moments_.clear();
  turns_.clear();
  lowest_.clear();
  for (Track& track : tracks_) track = {};
}

std::optional<PosedSkeleton> JointFollower::solve(const FileFrame& frame) {
  MappedFrame seen = mapped(frame, layout_);
  drop_strays(seen, from_.reach);
  to_ours(seen, from_);
  if (!fill_trunk(seen)) {
    moments_.push_back(std::nullopt);
    while (moments_.size() > kLongestAgo + 1) moments_.pop_front();
    return {};
  }
  fill_limbs(seen);
  average(seen);
  look_at_root(seen.joints);
  remember(seen.joints);
  return forward_kinematics(rest_, pose_through(rest_, seen, believed(), noise_));
}

/// A hip or a shoulder that is missing moves with those that are seen. False: there is no trunk.
bool JointFollower::fill_trunk(MappedFrame& frame) {
  constexpr double kFarthest = 1e6;  // metres; who is further away is nobody
  tracks_.resize([&] {
    size_t count = 0;
    each_place(frame, [&](const auto&) { ++count; });
    return count;
  }());
  each_place(frame, [&](std::optional<Vec3>& x) {
    if (x && !(x->norm() < kFarthest)) x.reset();
  });
  Vec3 shift = Vec3::Zero();
  int moved = 0;
  bool any = false;
  for (size_t j = 0; j < kJoints; ++j) {
    if (!is_of_trunk(j) || !frame.joints[j]) continue;
    any = true;
    if (tracks_[j].place) shift += *frame.joints[j] - *tracks_[j].place, ++moved;
  }
  if (!any) return false;
  SeenFrame whole = frame.joints;
  for (size_t j = 0; j < kJoints; ++j)
    if (is_of_trunk(j) && !whole[j]) {
      if (!tracks_[j].place || moved == 0) return false;
      whole[j] = *tracks_[j].place + shift / moved;
    }
  if (!trunk_of(whole)) return false;
  frame.joints = whole;
  for (size_t j = 0; j < kJoints; ++j)
    if (is_of_trunk(j)) tracks_[j].place = whole[j];
  return true;
}

/// What is missing of a limb stays where it was, as the trunk sees it, for a while.
void JointFollower::fill_limbs(MappedFrame& frame) {
  const Trunk trunk = trunk_of(frame.joints).value();
  size_t i = 0;
  each_place(frame, [&](std::optional<Vec3>& x) {
    Track& track = tracks_[i];
    if (is_of_trunk(i++)) return;
    if (x) {
      track = {trunk.axes.transpose() * (*x - trunk.origin), 0};
    } else if (track.place && ++track.age <= kLongestHold) {
      x = trunk.origin + trunk.axes * *track.place;
    }
  });
}

/// Places of noisy joints: the mean of the last ones, of which the newest counts most.
void JointFollower::average(MappedFrame& frame) {
  if (!(sigma_ > 0)) return;
  const auto reach = static_cast<size_t>(std::ceil(3 * sigma_));
  places_.push_front(frame);
  if (places_.size() > reach + 1) places_.pop_back();
  std::vector<Vec3> sums(tracks_.size(), Vec3::Zero());
  std::vector<double> weights(tracks_.size(), 0.0);
  std::vector<bool> ended(tracks_.size(), false);
  for (size_t ago = 0; ago < places_.size(); ++ago) {
    size_t i = 0;
    each_place(places_[ago], [&](const std::optional<Vec3>& x) {
      const size_t at = i++;
      if (!x) ended[at] = true;
      if (ended[at]) return;
      sums[at] += weight_of(ago, sigma_) * *x;
      weights[at] += weight_of(ago, sigma_);
    });
  }
  size_t i = 0;
  each_place(frame, [&](std::optional<Vec3>& x) {
    if (x) x = sums[i] / weights[i];
    ++i;
  });
}

/// Moments that were missing lie between those around them.
void JointFollower::remember(const SeenFrame& seen) {
  size_t gap = 0;
  while (gap < moments_.size() && !moments_[moments_.size() - 1 - gap]) ++gap;
  if (gap == moments_.size()) moments_.clear(), gap = 0;
  for (size_t k = 1; k <= gap; ++k) {
    const SeenFrame& before = *moments_[moments_.size() - 1 - gap];
    const double t = static_cast<double>(k) / static_cast<double>(gap + 1);
    SeenFrame between;
    for (size_t j = 0; j < kJoints; ++j)
      if (before[j] && seen[j]) between[j] = Vec3((1 - t) * *before[j] + t * *seen[j]);
    moments_[moments_.size() - 1 - gap + k] = between;
  }
  moments_.push_back(seen);
  while (moments_.size() > kLongestAgo + 1) moments_.pop_front();
}

/// Turns of the newest moment, averaged as the trunk sees them, so that a turning body does not
/// lag.
Rotations JointFollower::believed() {
  std::array<const SeenFrame*, kMoments.size()> around{};
  for (size_t m = 0; m < kMoments.size(); ++m) {
    const auto ago = static_cast<size_t>(-kMoments[m]);
    if (kMoments[m] <= 0 && ago < moments_.size())
      around[m] = &*moments_[moments_.size() - 1 - ago];
  }
  const Mat3 axes = trunk_of(*moments_.back()).value_or(Trunk{Mat3::Identity(), Vec3::Zero()}).axes;
  Rotations now = believed_now(around).turns;
  for (Mat3& turn : now) turn = axes.transpose() * turn;
  turns_.push_front(now);
  if (turns_.size() > kTurnsAveraged) turns_.pop_back();
  Rotations out;
  for (size_t j = 0; j < kJoints; ++j) {
    Mat3 sum = Mat3::Zero();
    for (size_t ago = 0; ago < turns_.size(); ++ago) sum += weight_of(ago, 1) * turns_[ago][j];
    out[j] = axes * turn_between({Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()},
                                 {sum.col(0), sum.col(1), sum.col(2)}, now[j]);
  }
  return out;
}

/// Who steps down from a box stands below the floor of the first second.
void JointFollower::look_at_floor(double lowest) {
  constexpr double kBelow = 0.08;   // metres; less is noise, or a foot that is bent
  constexpr double kSteady = 0.1;   // metres between the heights of a foot that stands
  constexpr double kFollows = 0.2;  // of the way in a frame
  lowest_.push_back(lowest);
  if (lowest_.size() > static_cast<size_t>(kFps)) lowest_.pop_front();
  const auto [least, most] = std::minmax_element(lowest_.begin(), lowest_.end());
  if (lowest_.size() == static_cast<size_t>(kFps) && *most < lower_ - kBelow &&
      *most - *least < kSteady) {
    const double stands = floor_height(std::vector<double>(lowest_.begin(), lowest_.end()));
    sinks_ = lower_ - stands;
    lower_ = stands;
  }
  floor_ += kFollows * (lower_ - floor_);
}

/// Joints relative to the root are told by a root that never moves at all; nobody stands so still.
void JointFollower::look_at_root(const SeenFrame& seen) {
  constexpr double kStill = 1e-4;  // metres
  const Vec3 hips = middle_of_hips(seen);
  if (!looked_) {
    looked_ = true;
    still_pelvis_ = seen[kPelvis];
    still_hips_ = hips;
    return;
  }
  if (still_hips_ && (hips - *still_hips_).norm() > kStill) still_hips_.reset();
  if (still_pelvis_ && seen[kPelvis] && (*seen[kPelvis] - *still_pelvis_).norm() > kStill)
    still_pelvis_.reset();
}

}  // namespace restage
