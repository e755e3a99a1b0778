// A target that its own file poses: its bones, its skin and its rest pose are those of a rigged
// character, not those that networks find.
#pragma once

#include "nn/geometry/body.h"
#include "nn/geometry/hands.h"

namespace restage {

class OwnRig {
 public:
  OwnRig() = default;
  OwnRig(const OwnRig&) = delete;
  OwnRig& operator=(const OwnRig&) = delete;
  virtual ~OwnRig() = default;

  /// The character in T-pose, metres, y up, facing +z, its lowest point at y = 0.
  virtual const Mesh& mesh() const = 0;
  virtual const Joints& rest() const = 0;
  /// [vertices, 22]: each bone's weight counts for the nearest of the 22 joints at it or above it.
  virtual SkinWeights weights() const = 0;
  /// Where the file's bones put joints and vertices, in the world, metres. Bones that are none of
  /// the 22 joints keep their rest, but for those of `fingers` (may be null) that the rig has;
  /// turns of joints that the rig lacks are left out. So joints may lie elsewhere than
  /// forward_kinematics() says. `vertices` may be null.
  virtual void place(const Pose& pose, const FingerTurns* fingers, Joints* joints,
                     Points* vertices) const = 0;
};

}  // namespace restage
