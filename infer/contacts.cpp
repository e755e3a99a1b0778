#include "infer/contacts.h"

#include <algorithm>
#include <cmath>

#include "nn/geometry/contact.h"

namespace restage {
namespace {

// In lengths of the arm, shoulder to wrist.
constexpr double kTouching = 0.02, kAway = 0.15;     // from the surface of the hand
constexpr double kHandsNear = 0.5, kHandsFar = 0.7;  // from wrist to wrist
constexpr double kThick = 0.04;                      // thick hands are so much farther apart
constexpr std::array<double, 3> kOnHand = {0.05, 0.5, 0.9};  // places along a hand
constexpr int kRounds = 4;

/// What the left hand can touch, but for the right hand; and the right hand, but for the left one.
constexpr std::array<std::array<BodyPart, 11>, 2> kTouchable = {
    {{BodyPart::belly, BodyPart::chest, BodyPart::head, BodyPart::left_thigh, BodyPart::right_thigh,
      BodyPart::left_shin, BodyPart::right_shin, BodyPart::left_foot, BodyPart::right_foot,
      BodyPart::right_upper_arm, BodyPart::right_forearm},
     {BodyPart::belly, BodyPart::chest, BodyPart::head, BodyPart::left_thigh, BodyPart::right_thigh,
      BodyPart::left_shin, BodyPart::right_shin, BodyPart::left_foot, BodyPart::right_foot,
      BodyPart::left_upper_arm, BodyPart::left_forearm}}};

double arm_length(const Joints& joints) {
  const auto bone = [&](int a, int b) {
    return (joints[static_cast<size_t>(a)] - joints[static_cast<size_t>(b)]).norm();
  };
  return 0.5 * (bone(kLeftShoulder, kLeftElbow) + bone(kLeftElbow, kLeftWrist) +
                bone(kRightShoulder, kRightElbow) + bone(kRightElbow, kRightWrist));
}

/// 1 below `near`, 0 above `far`, smooth between.
double falling(double x, double near, double far) {
  const double t = std::clamp((far - x) / (far - near), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// A place of a hand over a part.
struct Over {
  PlaceOnPart place;
  double gap;  ///< between the two surfaces, metres
  Vec3 out;
};

Over over(const BodyInPose& figure, int side, double share, BodyPart part, const Vec3& moved) {
  const Vec3 at = figure.surfaces.on_hand(side, figure.posed, share, figure.size) + moved;
  const NearPart near = figure.surfaces.locate(part, figure.posed, at, figure.size);
  return {
      near.place,
      near.over - figure.surfaces.hand_radius(side, figure.posed, share, -near.out, figure.size),
      near.out};
}

/// How the source's hand lies over one part, and what that asks of the target's.
struct Asked {
  BodyPart part;
  double share;
  Over source;
  double weight;
};

class Solve {
 public:
  Solve(const BodyInPose& source, const BodyInPose& target, const std::array<double, 2>& sure)
      : source_(source),
        target_(target),
        arm_(arm_length(source.posed.joints)),
        scale_(arm_length(target.posed.joints) / std::max(arm_, 1e-6)) {
    for (size_t side = 0; side < 2; ++side) {
      auto asked = asked_[side].begin();
      for (const BodyPart part : kTouchable[side])
        for (const double share : kOnHand) {
          const Over at = over(source_, static_cast<int>(side), share, part, Vec3::Zero());
          *asked++ = {part, share, at, sure[side] * falling(at.gap / arm_, kTouching, kAway)};
        }
    }
    hands_ =
        std::min(sure[0], sure[1]) * falling(apart(source_).norm() / arm_, kHandsNear, kHandsFar);
  }

  /// By how much each wrist has to move, metres.
  std::array<Vec3, 2> operator()() {
    for (const int side : {0, 1}) touch(side);
    for (int round = 0; round < kRounds; ++round) {
      keep_hands();
      for (const int side : {0, 1}) leave_parts(side);
    }
    hold_hands();
    for (const int side : {0, 1}) keep_unfolded(side);
    return moved_;
  }

 private:
  static Vec3 apart(const BodyInPose& figure) {
    return figure.posed.joints[kRightWrist] - figure.posed.joints[kLeftWrist];
  }

  /// What touches touches: the nearest parts decide.
  void touch(int side) {
    Vec3 sum = Vec3::Zero();
    double weights = 0, most = 0;
    for (const Asked& asked : asked_[static_cast<size_t>(side)]) {
      if (asked.weight <= 0) continue;
      const Vec3 now = target_.surfaces.on_hand(side, target_.posed, asked.share, target_.size);
      const double weight = std::pow(asked.weight, 4);
      sum += weight * (wanted(side, asked) - now);
      weights += weight;
      most = std::max(most, asked.weight);
    }
    if (weights <= 1e-12) return;
    const Vec3 by = sum / weights;
    moved_[static_cast<size_t>(side)] = most * within_reach(side, by) * by;
  }

  /// What a short arm cannot reach is not reached for: the arm would go through the body. Nor is an
  /// arm folded as none can be.
  double within_reach(int side, const Vec3& by) const {
    constexpr double kReach = 1, kBeyond = 1.25;  // of the arm
    const auto at = [&](int joint) {
      return target_.posed.joints[static_cast<size_t>(joint + side)];
    };
    const double arm = std::max(scale_ * arm_, 1e-9);
    const double now = (at(kLeftWrist) - at(kLeftShoulder)).norm() / arm,
                 far = (at(kLeftWrist) + by - at(kLeftShoulder)).norm() / arm;
    const double least = std::min(now, folded(side, 0.4));
    return falling(far, kReach, kBeyond) * (1 - falling(far, 0.5 * least, least));
  }
  /// The least distance of a wrist from its shoulder, in lengths of the arm: the usual one, or more
  /// where upper arm and forearm differ much. A wrist at their difference leaves its elbow one
  /// place only, through which it would jump.
  double folded(int side, double usual) const {
    constexpr double kAbove = 0.12;
    const auto bone = [&](int a, int b) {
      return (target_.posed.joints[static_cast<size_t>(a + side)] -
              target_.posed.joints[static_cast<size_t>(b + side)])
          .norm();
    };
    const double upper = bone(kLeftShoulder, kLeftElbow), lower = bone(kLeftElbow, kLeftWrist);
    return std::max(usual, std::abs(upper - lower) / std::max(scale_ * arm_, 1e-9) + kAbove);
  }
  /// The same of what moves a hand out of parts.
  void keep_unfolded(int side) {
    const auto at = [&](int joint) {
      return target_.posed.joints[static_cast<size_t>(joint + side)];
    };
    Vec3& by = moved_[static_cast<size_t>(side)];
    const Vec3 now = at(kLeftWrist) - at(kLeftShoulder);
    const double least = std::min(now.norm(), folded(side, 0.3) * scale_ * arm_);
    const Vec3 then = now + by;
    if (then.norm() >= least) return;
    const Vec3 out = (then + 0.2 * now).normalized();
    by = least * out - now;
  }

  Vec3 wanted(int side, const Asked& asked) const {
    const Vec3 on =
        target_.surfaces.point(asked.part, target_.posed, asked.source.place, 0, target_.size);
    const Vec3 further =
        target_.surfaces.point(asked.part, target_.posed, asked.source.place, 1, target_.size);
    const Vec3 out = further - on;
    const double radius =
        target_.surfaces.hand_radius(side, target_.posed, asked.share, -out, target_.size);
    return on + (radius + scale_ * asked.source.gap) * out;
  }

  /// Each wrist goes half of the way.
  void keep_hands() {
    if (hands_ <= 0) return;
    move_apart(thicker() + off());
  }
  /// Hands that are near each other matter more than what they go through.
  void hold_hands() {
    const double most = kThick * scale_ * arm_, far = off().norm();
    if (hands_ > 0 && far > most) move_apart((1 - most / far) * off());
  }
  /// What lacks from the left wrist to the right one.
  Vec3 off() const { return scale_ * apart(source_) - (apart(target_) + moved_[1] - moved_[0]); }
  void move_apart(const Vec3& by) {
    moved_[0] -= 0.5 * hands_ * by;
    moved_[1] += 0.5 * hands_ * by;
  }

  /// How much farther apart the hands have to be not to go through each other deeper than the
  /// source's, from the left one to the right one.
  Vec3 thicker() const {
    const Vec3 by = scale_ * apart(source_) - apart(target_);
    Vec3 out = Vec3::Zero();
    for (const double share : kOnHand)
      for (const int side : {0, 1}) {
        const BodyPart other = side == 0 ? BodyPart::right_hand : BodyPart::left_hand;
        const double sign = side == 0 ? -1 : 1;  // the left hand moves, or the right one
        const Over theirs = over(source_, side, share, other, Vec3::Zero());
        const Over ours = over(target_, side, share, other, sign * (by + out));
        const double depth = std::min(scale_ * theirs.gap, 0.0) - ours.gap;
        if (depth > 0) out += sign * depth * ours.out;
      }
    const double most = kThick * scale_ * arm_;
    return out * std::min(1.0, most / std::max(out.norm(), 1e-9));
  }

  /// What goes through a part deeper than the source's hand is moved out of it.
  void leave_parts(int side) {
    Vec3& moved = moved_[static_cast<size_t>(side)];
    for (const Asked& asked : asked_[static_cast<size_t>(side)]) {
      const Over now = over(target_, side, asked.share, asked.part, moved);
      const double depth = std::min(scale_ * asked.source.gap, 0.0) - now.gap;
      if (depth > 0) moved += depth * now.out;
    }
  }

  const BodyInPose& source_;
  const BodyInPose& target_;
  double arm_, scale_, hands_;
  std::array<std::array<Asked, kTouchable[0].size() * kOnHand.size()>, 2> asked_;
  std::array<Vec3, 2> moved_ = {Vec3::Zero(), Vec3::Zero()};
};

}  // namespace

std::array<Vec3, 2> Contacts::moves(const BodyInPose& source, const Joints& rest, const Pose& pose,
                                    const std::array<double, 2>& sure) const {
  const PosedSkeleton posed = forward_kinematics(rest, pose);
  const BodyInPose target{target_, posed};
  return Solve(source, target, sure)();
}

namespace {

constexpr double kNothingMoves = 1e-5;  // metres

std::array<Vec3, 2> elbows_of(const Joints& rest, const Pose& pose) {
  const Joints joints = forward_kinematics(rest, pose).joints;
  return {joints[kLeftElbow], joints[kRightElbow]};
}

}  // namespace

void move_hands(const Joints& rest, const std::array<Vec3, 2>& by, Pose* pose) {
  for (const int side : {0, 1})
    if (const Vec3& offset = by[static_cast<size_t>(side)]; offset.norm() > kNothingMoves)
      move_hand(rest, side, offset, pose);
}

std::array<Vec3, 2> elbows_moved(const Joints& rest, const std::array<Vec3, 2>& by,
                                 const Pose& pose) {
  Pose moved = pose;
  move_hands(rest, by, &moved);
  const std::array<Vec3, 2> before = elbows_of(rest, pose), after = elbows_of(rest, moved);
  return {after[0] - before[0], after[1] - before[1]};
}

void move_hands(const Joints& rest, const std::array<Vec3, 2>& by,
                const std::array<Vec3, 2>& elbows, Pose* pose) {
  const std::array<Vec3, 2> before = elbows_of(rest, *pose);
  move_hands(rest, by, pose);
  for (size_t side = 0; side < 2; ++side)
    if (elbows[side].norm() > kNothingMoves)
      turn_elbow(rest, static_cast<int>(side), before[side] + elbows[side], pose);
}

}  // namespace restage
