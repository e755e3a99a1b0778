// restage stream of joints without rotations: lines of JSON in, poses of the target out.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "datasets/importers/joints/follow.h"
#include "datasets/importers/joints/joint_lines.h"
#include "experiments/cli/perform/retarget.h"
#include "infer/contacts.h"
#include "infer/footing.h"
#include "infer/live/cloud.h"

namespace restage::cli {

/// The first second is learnt from (JointFollower) and answered by nothing. Another sender is
/// another person, from whom it is learnt anew.
class StreamJoints {
 public:
  /// `system` shows a target without a rig of its own; both must live longer. `vertices`: whether
  /// frames have them.
  StreamJoints(const RetargetCommand& c, const TargetMesh& target, const System& system,
               bool vertices);

  /// What a line says. UnusableCloud: it cannot be read, or shows nobody.
  JointLine read(const live::LiveCloud& line);
  /// The pose of the moment, `missed` moments after the one before; nothing while it is learnt.
  /// UnusableCloud: the line does not show the person. InputError: what the first lines hold cannot
  /// be used, three times in a row.
  std::optional<RetargetedFrame> answer(const JointLine& said, const live::LiveCloud& line,
                                        int64_t missed);
  /// Whether the fault that was thrown last is told later: by finish(), or, where something came
  /// that can be used, by a warning.
  bool holds_fault() const { return quiet_; }
  /// Moments that came, of a second that is to be learnt from.
  size_t learning() const { return first_.size(); }
  /// The motion begins anew.
  void restart();
  /// There are no more lines. InputError: no line could be read, or what the first ones hold cannot
  /// be used.
  void finish() const;

 private:
  void prepare();
  void learn(const std::string& name);
  void begin(const JointFollower& follower, ImportReport report);
  RetargetedFrame perform(const PosedSkeleton& source);
  void touch(const PosedSkeleton& source, Pose* pose);
  void forget();
  void hold(const InputError& fault);
  void tell_held(const std::string& what);

  const RetargetCommand& c_;
  const TargetMesh& target_;
  const System& system_;
  const bool vertices_;
  JointLines lines_;
  int64_t sender_ = 0;            ///< of the last line; 0: none has come
  std::vector<JointLine> first_;  ///< to be learnt from, a moment each
  int refused_ = 0;               ///< so often in a row they could not be used
  std::optional<InputError> fault_;
  bool held_ = false;   ///< `fault_` has not been told
  bool quiet_ = false;  ///< what was thrown last is told later
  bool any_ = false;    ///< a line could be read
  int unreadable_ = 0;  ///< lines before that
  std::optional<JointFollower> follower_;
  size_t names_ = 0;   ///< that the follower knows
  SkeletonTake take_;  ///< the source, of which one frame is held
  std::optional<Footing> footing_;
  std::optional<Contacts> contacts_;
  std::optional<PartSurfaces> theirs_;
  std::array<Vec3, 2> hands_moved_ = {Vec3::Zero(), Vec3::Zero()};
};

}  // namespace restage::cli
