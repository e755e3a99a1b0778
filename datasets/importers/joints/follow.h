// Joints without rotations while they are captured: the poses of solve.h, of which each is found
// from the joints of its own moment and of those before it.
#pragma once

#include <deque>

#include "datasets/importers/joints/clean.h"

namespace restage {

/// Follows one person at 30 frames a second. What holds for all of a recording (the order of the
/// joints, axes, unit, the bones' lengths, how noisy places are, where the floor is) is learnt from
/// its first frames and then held. Differs from solve_joints() in what is known later only:
/// - the network of turns sees no later moment;
/// - turns, and places of noisy joints, are averages over moments before, so they lag by 0.5 to 1.3
///   frames;
/// - a joint that is missing stays where it was, as the trunk sees it, for half a second; a hip or
///   a shoulder goes with the others of the trunk for as long as it is missing.
class JointFollower {
 public:
  /// `first`: a second or so at 30 fps; a frame that is missing has no joints. Facts and remarks go
  /// into the report. InputError as find_joint_recording() and clean_joints() say.
  JointFollower(const JointRecording& first, const MotionOptions& options, ImportReport& report);

  /// The T-pose that turns are counted from, metres, y up, facing +z, the pelvis at 0.
  const Joints& rest() const { return rest_; }
  /// The poses of those first frames that show the trunk, as next() finds them, on a floor at y =
  /// 0.
  const std::vector<PosedSkeleton>& first() const { return first_; }
  /// The next frame, in the source's axes and units. Nothing: it does not show the trunk, or it is
  /// missing (no joints).
  std::optional<PosedSkeleton> next(const FileFrame& frame);
  /// Feet that stand well below the floor for a second stand on another one: the floor goes down to
  /// it within half a second. So far, metres, when that begins with the last frame; else 0.
  double floor_sinks() const { return sinks_; }
  /// Joints that are called by names: more of them have come.
  void rename(const JointLayout& layout) { layout_ = layout; }
  /// There is a gap: what was seen before says nothing of what comes. What was learnt stays.
  void restart();

 private:
  struct Track {
    std::optional<Vec3> place;  ///< where it was last; of a limb as the trunk sees it
    int age = 0;                ///< frames since it was seen
  };
  std::optional<PosedSkeleton> solve(const FileFrame& frame);
  bool fill_trunk(MappedFrame& frame);
  void fill_limbs(MappedFrame& frame);
  void average(MappedFrame& frame);
  void remember(const joints_detail::SeenFrame& seen);
  Rotations believed();
  void look_at_floor(double lowest);
  void look_at_root(const joints_detail::SeenFrame& seen);
  bool in_place() const { return still_pelvis_ || still_hips_; }

  JointLayout layout_;
  joints_detail::JointFrame from_;
  Joints rest_;
  double noise_ = 0, sigma_ = 0;
  double floor_ = 0, lower_ = 0;  ///< the floor, and where it goes; metres
  double sinks_ = 0;
  std::deque<double> lowest_;  ///< heights of the lower foot in the last second
  std::vector<PosedSkeleton> first_;
  std::vector<Track> tracks_;
  std::deque<MappedFrame> places_;  ///< the last ones before they were averaged
  /// The last moments, the newest last; nothing: it was missing.
  std::deque<std::optional<joints_detail::SeenFrame>> moments_;
  std::deque<Rotations> turns_;  ///< that were believed, as the trunk sees them
  /// Where pelvis and middle of the hips are, as long as they never move.
  std::optional<Vec3> still_pelvis_, still_hips_;
  bool looked_ = false;  ///< at the root
};

}  // namespace restage
