// Hands that touch what the source's hands touch, and go no deeper into the body.
#pragma once

#include "nn/geometry/part_surfaces.h"

namespace restage {

/// Somebody in a pose, for the contacts of another.
struct BodyInPose {
  const PartSurfaces& surfaces;
  const PosedSkeleton& posed;
  double size = 1;  ///< how much larger it is than its surfaces
};

/// Copied rotations keep a pose, and lose what touches where figures differ. So each arm is turned,
/// in shoulder and elbow, until its hand is where the source's hand is: over the same place of the
/// same part, as far from the surface. That counts fully where the source's hand touches, and not
/// at all where it is farther away than 0.15 of an arm; then only what would go through a part is
/// moved out of it. Two hands that are near each other keep their distance and its direction, in
/// lengths of the arm. What an arm cannot reach it does not reach for. A frame is solved for
/// itself: who moves hands by it smooths it over the frames, or lets the hands follow.
///
/// Interaction descriptors over places of a surface: Al-Asqhar et al. 2013, "Relationship
/// descriptors for interactive motion adaptation"; here with one place a part and a closed form.
class Contacts {
 public:
  explicit Contacts(PartSurfaces target) : target_(std::move(target)) {}

  /// By how much the left and the right hand of the target have to move, metres. `rest`: its joints
  /// in T-pose. `sure`: 0 to 1, how far the places of the source's hands can be trusted.
  std::array<Vec3, 2> moves(const BodyInPose& source, const Joints& rest, const Pose& pose,
                            const std::array<double, 2>& sure = {1, 1}) const;

 private:
  PartSurfaces target_;
};

/// Moves both hands as far as the arms reach.
void move_hands(const Joints& rest, const std::array<Vec3, 2>& by, Pose* pose);

/// By how much move_hands() moves the left and the right elbow, metres. A wrist that is moved far
/// can go smoothly while its elbow jumps to the other side of the arm.
std::array<Vec3, 2> elbows_moved(const Joints& rest, const std::array<Vec3, 2>& by,
                                 const Pose& pose);
/// The same as move_hands(), with elbows as near as they come to where `elbows` moves them: of
/// elbows_moved(), smoothed over the frames.
void move_hands(const Joints& rest, const std::array<Vec3, 2>& by,
                const std::array<Vec3, 2>& elbows, Pose* pose);

}  // namespace restage
