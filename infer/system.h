// What every way of retargeting has in common: a target and the clouds of a source go in, frames of
// the target come out. The commands `retarget` and `eval` use systems through this interface only.
// Systems are our networks (retargeter.h), "register then repose" (registration/registration.h) and
// a mixture of both (registration/refinement.h); systems.h finds a system by its name.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "nn/geometry/body.h"
#include "nn/geometry/hands.h"

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

class System {
 public:
  System() = default;
  System(const System&) = delete;
  System& operator=(const System&) = delete;
  virtual ~System() = default;

  /// Takes the next cloud of the source (metres, y up) and returns the frames of the result that
  /// are finished by it: none, one or several. The returned frames are valid until the next call of
  /// a function that is not const. `source` names the cloud in errors. UnusableCloud if the cloud
  /// cannot be used; the system is then in the state before the call.
  virtual std::span<const RetargetedFrame> push(const Points& cloud, const std::string& source) = 0;
  /// Tells the system that a frame of the source is missing or cannot be used; is called in place
  /// of push() for that frame. Frames of the result that fall into the gap are returned by the next
  /// push(), or by finish() if no push() follows.
  virtual void miss() = 0;
  /// Tells the system that the source has ended, and returns the frames that push() has not
  /// returned yet: the frames of a gap at the end, and the last frames of a system that answers
  /// late. No frames if every frame of the source was missed. A push() after it begins a new
  /// sequence, as after restart().
  virtual std::span<const RetargetedFrame> finish() = 0;
  /// Forgets the motion so far; the next push() begins a new sequence.
  virtual void restart() = 0;

  virtual const Mesh& target() const = 0;
  /// Null for a system that moves vertices without a skeleton; its results cannot be written as GLB
  /// or BVH.
  virtual const SystemRig* rig() const = 0;
  /// The target's vertices in a pose of the rig(), world, metres; empty without a rig.
  virtual Points posed(const Pose& pose) const = 0;
  /// The target's joints in T-pose; null if the system knows none.
  virtual const Joints* target_joints() const = 0;
  /// The source's joints in the cloud that was pushed last; null if the system finds no joints.
  virtual const Joints* source_joints() const = 0;
  /// How long the last push() took.
  virtual FrameTimes times() const { return {}; }
};

}  // namespace restage
