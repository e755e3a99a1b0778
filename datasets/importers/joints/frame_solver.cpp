#include "datasets/importers/joints/frame_solver.h"

#include <algorithm>
#include <cmath>

#include "datasets/importers/joints/skeleton_of.h"

namespace restage::joints_detail {
namespace {

/// The pose of a skeleton that goes through the joints of one frame.
class FrameSolver {
 public:
  /// `noise`: of a joint's place, metres.
  FrameSolver(const Joints& rest, const MappedFrame& seen, const Rotations& believed, double noise)
      : rest_(rest), seen_(seen), turns_(believed), noise_(noise) {}

  Pose solve() {
    pelvis();
    if (!seen_.joints[kSpine3] || !seen_.joints[kNeck]) lean();
    for (const int j : {kSpine1, kSpine2}) point(j, child_of(j));
    chest();
    for (const auto& [share, joints] : kWithParent)
      for (const int j : joints) {
        Mat3& own = turn(j);
        const Mat3& parent = turn(kParents[static_cast<size_t>(j)]);
        const bool of_foot =
            j == kLeftAnkle || j == kRightAnkle || j == kLeftFoot || j == kRightFoot;
        const bool blind = of_foot && !seen(j % 2 == 1 ? kLeftFoot : kRightFoot);
        own = Quat(own).slerp(blind ? kBlind : share, Quat(parent)).toRotationMatrix();
        if (child_of(j) != j) point(j, child_of(j));
      }
    head();
    for (const size_t side : {0u, 1u}) hand(side);
    return {to_local(turns_), root_};
  }

 private:
  /// Joints, parents first, and how much of a turn about the bone each has from its parent rather
  /// than from the network: of feet, ankles and neck joints say little, and people differ in how
  /// they were recorded.
  static inline const std::vector<std::pair<double, std::vector<int>>> kWithParent = {
      {0, {kLeftCollar, kRightCollar, kLeftShoulder, kRightShoulder, kLeftElbow, kRightElbow}},
      {0.2, {kLeftHip, kRightHip, kLeftKnee, kRightKnee}},
      {1, {kLeftAnkle, kRightAnkle, kLeftFoot, kRightFoot}},
      {0.7, {kNeck}}};
  static constexpr double kBlind = 0.2;  ///< of ankles and feet whose foot is not seen
  static int child_of(int joint) {
    for (int j = 1; j < kJoints; ++j)
      if (kParents[static_cast<size_t>(j)] == joint) return j;
    return joint;
  }
  Vec3 offset(int from, int to) const {
    return rest_[static_cast<size_t>(to)] - rest_[static_cast<size_t>(from)];
  }
  const std::optional<Vec3>& seen(int joint) const {
    return seen_.joints[static_cast<size_t>(joint)];
  }
  Mat3& turn(int joint) { return turns_[static_cast<size_t>(joint)]; }

  /// Where a joint is by the turns of its ancestors.
  Vec3 place(int joint) const {
    if (joint == kPelvis) return root_;
    const int p = kParents[static_cast<size_t>(joint)];
    return place(p) + turns_[static_cast<size_t>(p)] * offset(p, joint);
  }

  /// By what is known of the hips, of the spine and of its own place.
  void pelvis() {
    std::vector<Vec3> from = {offset(kRightHip, kLeftHip)},
                      to = {*seen(kLeftHip) - *seen(kRightHip)};
    // Without the spine the pelvis lies nearly between the hips and says nothing of its lean.
    if (seen(kPelvis) && seen(kSpine1)) {
      for (const int c : {kLeftHip, kRightHip, kSpine1})
        if (seen(c)) {
          from.push_back(offset(kPelvis, c));
          to.push_back(*seen(c) - *seen(kPelvis));
        }
    }
    Mat3 guess = turn(kPelvis);
    guess = shortest_arc(guess * from[0], to[0]) * guess;
    if (from.size() > 1)
      settle(kPelvis, turn_between(from, to, guess), from[0].norm());
    else
      turn(kPelvis) = guess;
    const Vec3 middle = 0.5 * (*seen(kLeftHip) + *seen(kRightHip));
    root_ =
        middle - turn(kPelvis) * (0.5 * (offset(kPelvis, kLeftHip) + offset(kPelvis, kRightHip)));
  }

  /// Leans the spine so that the shoulders lie where they are seen, where the spine's own joints
  /// are not known.
  void lean() {
    for (int round = 0; round < 2; ++round) {
      const Vec3 from = place(kSpine1);
      const Vec3 now = 0.5 * (place(kLeftShoulder) + place(kRightShoulder)) - from,
                 wanted = 0.5 * (*seen(kLeftShoulder) + *seen(kRightShoulder)) - from;
      const Mat3 arc = shortest_arc(now, wanted);
      for (const int j : {kSpine1, kSpine2, kSpine3, kNeck, kHead, kLeftCollar, kRightCollar})
        turn(j) = arc * turn(j);
    }
  }

  /// Turns a joint the shortest way so that its child lies in the direction in which it is seen.
  void point(int joint, int child) {
    if (!seen(child)) return;
    const Vec3 from = seen(joint) ? *seen(joint) : place(joint);
    settle(joint,
           shortest_arc(turn(joint) * offset(joint, child), *seen(child) - from) * turn(joint),
           offset(joint, child).norm());
  }

  /// Turns a joint as bones of this length say. The shorter they are and the noisier their ends,
  /// the more of what the network believes stays.
  void settle(int joint, const Mat3& wanted, double length) {
    constexpr double kBelief = 0.08;   // radians by which the network errs
    constexpr double kExact = 0.0005;  // metres
    const double error = 1.4 * noise_ / std::max(length, 1e-6);
    const double share =
        noise_ < kExact ? 1 : kBelief * kBelief / (kBelief * kBelief + error * error);
    turn(joint) =
        share == 1 ? wanted : Quat(turn(joint)).slerp(share, Quat(wanted)).toRotationMatrix();
  }

  void chest() {
    const Vec3 here = seen(kSpine3) ? *seen(kSpine3) : place(kSpine3);
    std::vector<Vec3> from, to;
    for (const int c : {kNeck, kLeftCollar, kRightCollar})
      if (seen(c)) {
        from.push_back(offset(kSpine3, c));
        to.push_back(*seen(c) - here);
      }
    if (from.size() > 1)
      settle(kSpine3, turn_between(from, to, turn(kSpine3)), from[0].norm());
    else if (from.size() == 1)
      settle(kSpine3, shortest_arc(turn(kSpine3) * from[0], to[0]) * turn(kSpine3), from[0].norm());
  }

  /// By ears and nose, where they are known: the ears lie across, the nose ahead and a little
  /// lower.
  void head() {
    if (!seen_.nose || !seen_.left_ear || !seen_.right_ear) return;
    const Vec3 across = (*seen_.left_ear - *seen_.right_ear).normalized();
    const Vec3 ahead = *seen_.nose - 0.5 * (*seen_.left_ear + *seen_.right_ear);
    const Vec3 low = Vec3(0, -0.3, 1).normalized();
    turn(kHead) = turn_between({Vec3::UnitX(), low}, {across, ahead.normalized()}, turn(kHead));
  }

  /// By the knuckles, where they are known: in T-pose fingers point outwards, index before little.
  void hand(size_t side) {
    const int wrist = side == 0 ? kLeftWrist : kRightWrist;
    const Vec3 out = side == 0 ? Vec3::UnitX() : Vec3(-Vec3::UnitX());
    if (!seen(wrist)) return;
    std::optional<Vec3> middle = seen_.hand[side];
    if (!middle && seen_.index[side] && seen_.pinky[side])
      middle = Vec3(0.5 * (*seen_.index[side] + *seen_.pinky[side]));
    // Hands in another order than ours are further away than a hand.
    constexpr double kHand = 0.25;  // metres
    if (!middle || (*middle - *seen(wrist)).norm() > kHand) return;
    std::vector<Vec3> from = {out}, to = {(*middle - *seen(wrist)).normalized()};
    if (seen_.index[side] && seen_.pinky[side]) {
      from.emplace_back(Vec3::UnitZ());
      to.push_back((*seen_.index[side] - *seen_.pinky[side]).normalized());
      turn(wrist) = turn_between(from, to, turn(wrist));
    } else {
      turn(wrist) = shortest_arc(turn(wrist) * out, to[0]) * turn(wrist);
    }
  }

  const Joints& rest_;
  const MappedFrame& seen_;
  Rotations turns_;
  double noise_;
  Vec3 root_ = Vec3::Zero();
};

}  // namespace

Pose pose_through(const Joints& rest, const MappedFrame& seen, const Rotations& believed,
                  double noise) {
  return FrameSolver(rest, seen, believed, noise).solve();
}

}  // namespace restage::joints_detail
