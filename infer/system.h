// A system: a target and the clouds of a source go in, the target's frames come out. `retarget`,
// `eval` and `render` know nothing else; ours (retargeter.h), "register then repose"
// (registration/registration.h) and whatever comes later are systems by name (systems.h).
#pragma once

#include <optional>
#include <span>
#include <string>

#include "nn/geometry/body.h"

namespace restage {

/// The target in one frame of the 30 fps grid. pose and joints only of a system with a rig().
struct RetargetedFrame {
  Pose pose;        ///< local rotations, pelvis in the world
  Joints joints;    ///< posed, world
  Points vertices;  ///< posed, world, in the target's order
  /// Chance that a joint of the source is where it is believed to be, within kNearby
  /// (nn/models/views.h): mean of the 22, by the extractor's own estimate. Empty: nobody says.
  /// 0 in a filled frame, whose source nobody has seen.
  std::optional<double> confidence;
  /// No cloud of the source is behind this frame (System::miss()): it lies between those around the
  /// gap, or repeats the nearest one where the source begins or ends with a gap.
  bool filled = false;
};

/// Seconds that the parts of one push() took.
struct FrameTimes {
  double extract = 0, motion = 0, deformation = 0;
};

/// The skeleton that a system moves its target by.
struct SystemRig {
  const Joints& rest;          ///< T-pose
  const SkinWeights& weights;  ///< [vertices, 22]
};

class System {
 public:
  System() = default;
  System(const System&) = delete;
  System& operator=(const System&) = delete;
  virtual ~System() = default;

  /// One cloud of the source (metres, y up). An online system answers with the frames of the grid
  /// that this cloud ends, one that works in windows when a window is full. The frames live until
  /// the next call. UnusableCloud naming `source` for a cloud that cannot be used; the system is
  /// then as before the call.
  virtual std::span<const RetargetedFrame> push(const Points& cloud, const std::string& source) = 0;
  /// In the place of push() for a frame of the source that is missing or cannot be used. Time goes
  /// on; the next push() answers with the frames of the gap too, or finish() where none follows.
  virtual void miss() = 0;
  /// What is still held back when the source has ended: frames after a gap at the end, which repeat
  /// the last one, and those of a system that answers late. Nothing if every frame was missed.
  virtual std::span<const RetargetedFrame> finish() = 0;
  /// Forgets the motion so far.
  virtual void restart() = 0;

  virtual const Mesh& target() const = 0;
  /// Null: the system moves vertices only, so there is nothing to write as a skeleton.
  virtual const SystemRig* rig() const = 0;
  /// The target in a pose of its rig(), by the skinning of the system; empty without a rig.
  virtual Points posed(const Pose& pose) const = 0;
  /// The target's joints in T-pose as the system knows them; null if it knows none.
  virtual const Joints* target_joints() const = 0;
  /// The source's joints in the last cloud; null if the system finds none.
  virtual const Joints* source_joints() const = 0;
  /// What the last push() took.
  virtual FrameTimes times() const { return {}; }
};

}  // namespace restage
