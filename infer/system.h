// What every way of retargeting has in common: a target and the clouds of a source go in, frames of
// the target come out. The commands `retarget` and `eval` use systems through this interface only.
// Systems are our networks (retargeter.h), "register then repose" (registration/registration.h) and
// a mixture of both (registration/refinement.h); systems.h finds a system by its name.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "nn/geometry/body.h"
#include "nn/geometry/hands.h"
#include "nn/geometry/own_rig.h"

namespace restage {

/// The target in one frame of the result. Frames of the result are kFps a second, whatever the
/// source's rate is; their moments are called the grid.
struct RetargetedFrame {
  /// Local rotations; the pelvis in the world, metres. Means nothing where there are no `joints`.
  Pose pose;
  /// Of a source that has fingers, those of its skeleton; networks find none.
  std::optional<FingerTurns> fingers;
  /// The joints of `pose` in the world, metres. A system without a rig() has none.
  std::optional<Joints> joints;
  Points vertices;  ///< in the world, metres, in the target's order
  /// How sure the extractor is of the source's joints, 0 to 1: its estimate of the chance that a
  /// joint lies within kNearby (nn/models/views.h) of the place where the extractor puts the joint,
  /// averaged over the 22 joints. Empty: the system makes no estimate. 0 in a filled frame.
  std::optional<double> confidence;
  /// No cloud of the source is behind this frame (System::miss()). The frame lies between the
  /// frames before and after the gap; in a gap at the beginning or at the end of the source, the
  /// frame repeats the nearest one that has a cloud. With RetargetOptions::min_confidence the
  /// target waits in such a frame.
  bool filled = false;
};

/// How long the parts of one push() took, seconds.
struct FrameTimes {
  double extract = 0, motion = 0, deformation = 0;
};

/// The skeleton by which a system moves its target.
struct SystemRig {
  const Joints& rest;          ///< the joints in T-pose, metres
  const SkinWeights& weights;  ///< [vertices, 22]: how much each joint moves each vertex
};

/// A way of retargeting. A class of yours overrides the pure functions; each says when it is
/// called. What is the same for all systems stands here: frames that are missing are counted, a
/// source ends, a sequence begins anew, a target with bones and a skin of its own poses itself.
class System {
 public:
  /// What is done with a frame of the result. The frame is valid until the function returns.
  using Show = std::function<void(const RetargetedFrame&)>;

  System() = default;
  System(const System&) = delete;
  System& operator=(const System&) = delete;
  virtual ~System() = default;

  /// Takes the next cloud of the source (metres, y up) and hands the frames of the result that are
  /// finished by it to `show`: none, one or several. A frame is made after the one before it was
  /// shown, so a long gap takes no more memory than a short one. `source` names the cloud in
  /// errors. UnusableCloud if the cloud cannot be used; nothing was shown then, and the system is
  /// in the state before the call. After any other error, one of `show` too, call restart().
  void push(const Points& cloud, const std::string& source, const Show& show);
  /// Tells the system that a frame of the source is missing or cannot be used; is called in place
  /// of push() for that frame. Frames of the result that fall into the gap are shown by the next
  /// push(), or by finish() if no push() follows.
  void miss();
  /// Tells the system that the source has ended, and shows the frames that push() has not shown
  /// yet: the frames of a gap at the end, and the last frames of a system that answers late. No
  /// frames if every frame of the source was missed. Then begins anew, as restart() does.
  void finish(const Show& show);
  /// Forgets the motion so far; the next push() begins a new sequence.
  void restart();
  /// From now on the target's own file says where a pose puts its joints and vertices. The system
  /// must have been made for own->mesh() and own->rest(), and must have a pose in every frame.
  void wear(std::shared_ptr<const OwnRig> own);

  virtual const Mesh& target() const = 0;
  /// The target's joints in T-pose; null if the system knows none.
  virtual const Joints* target_joints() const = 0;
  /// The source's joints in the cloud that was pushed last; null if the system finds no joints.
  virtual const Joints* source_joints() const = 0;
  /// Null for a system that moves vertices without a skeleton; its results cannot be written as GLB
  /// or BVH.
  const SystemRig* rig() const { return system_rig_ ? &*system_rig_ : nullptr; }
  /// The target's vertices in a pose of the rig(), world, metres; empty without a rig.
  Points posed(const Pose& pose) const;
  /// How long the last push() took.
  FrameTimes times() const { return times_; }

 protected:
  /// Takes a cloud and shows the frames that it finishes, those of the gap before it too, with
  /// hand_out(). UnusableCloud: before anything is shown or changed.
  virtual void answer(const Points& cloud, const std::string& source, const Show& show) = 0;
  /// The source has ended after at least one cloud: shows the frames that are left.
  virtual void answer_rest(const Show& show) = 0;
  /// Forgets the motion so far.
  virtual void forget() = 0;
  /// Puts joints and vertices where frame.pose says. A system whose frames have no pose leaves the
  /// frame as it is.
  virtual void place(RetargetedFrame& frame) const = 0;

  /// Places a frame, unless its pose puts something where no number is, and shows it.
  void hand_out(RetargetedFrame& frame, const Show& show);
  /// What push() does around `answer()`, for a source that comes otherwise than as clouds.
  template <class Answer>
  void take(const Answer& answer) {
    times_ = {};
    answer();
    ++frames_;
    missed_ = 0;
    begun_ = true;
  }
  /// Frames of the source before the one that is answered, missing ones too.
  int64_t frames() const { return frames_; }
  /// How many of them, the last ones, are missing.
  int64_t missed() const { return missed_; }

  std::optional<SystemRig> system_rig_;  ///< of a system with a skeleton
  FrameTimes times_;

 private:
  void place_by_rig(RetargetedFrame& frame) const;

  std::shared_ptr<const OwnRig> own_;
  SkinWeights own_weights_;
  int64_t frames_ = 0, missed_ = 0;
  int64_t shown_ = 0;   ///< frames of the result
  bool begun_ = false;  ///< a frame of the source has been answered
};

/// Adds the time between its construction and its destruction to a sum, seconds.
class Stopwatch {
 public:
  explicit Stopwatch(double* seconds) : seconds_(seconds) {}
  ~Stopwatch() {
    *seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  double* seconds_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace restage
