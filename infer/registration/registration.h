// "Register then repose", the classical way to retarget without correspondences, as a reference
// beside the learned system (docs/benchmark.md): the target's own T-pose is registered to every
// cloud of the source, and the target then performs the motion that this took.
//
//   start    several headings and arm poses, and the frame before; the best few go on
//   rigid and articulated ICP (articulated.h): pose, size and bone lengths
//   free-form ICP (free_form.h): what is left of the shape
//   repose   the rotations of the registered parts, the target's own bones; the path of the pelvis
//            scaled by the length of the legs, as in nn/geometry/closed_form.h
//
// No network and no learned weights. It is told the target's 22 rest joints, as the rig of a
// character is. Its limits are those of the kind: every frame is a search that may end in another
// optimum (front and back, arms in the trunk, crossed legs), points of one frame know nothing of
// those of the next, and it takes seconds a frame.
#pragma once

#include <optional>
#include <string>

#include "infer/registration/free_form.h"
#include "infer/system.h"
#include "infer/waiting.h"

namespace restage {

/// One point, the mean, for each occupied cube of a grid of that width (metres), in the order of
/// the cubes. UnusableCloud naming `source`: fewer than 64 of them, values that are not finite.
std::vector<Vec3> thinned(const Points& cloud, double width, const std::string& source);

inline constexpr double kCloudGrid = 0.03;

struct RegistrationOptions {
  size_t nodes = kRigNodes;
  int searched = 12;  ///< starts that are fitted, besides the frame before
  double grid = kCloudGrid;
  bool free_form = true;
  ArticulatedOptions articulated;
  FreeFormOptions free_form_options;
};

class Registration final : public System {
 public:
  /// `where` names the target in errors. InputError: see make_rig().
  Registration(Mesh target, const Joints& rest, const std::string& where,
               const RegistrationOptions& options = {});

  /// The target performing one frame of the source (metres, y up). The same bits for any number of
  /// threads. UnusableCloud: see thinned(). In a gap before this frame poses are interpolated.
  std::span<const RetargetedFrame> push(const Points& cloud, const std::string& source) override;
  void miss() override { ++missed_; }
  std::span<const RetargetedFrame> finish() override;
  /// Forgets the frame before.
  void restart() override;
  /// The registered template's joints in the last frame, in the source's build.
  const Joints* source_joints() const override { return &source_joints_; }
  const Mesh& target() const override { return body_.rest; }
  const SystemRig* rig() const override { return &system_rig_; }
  Points posed(const Pose& pose) const override;
  const Joints* target_joints() const override { return &body_.joints; }

 private:
  std::vector<RigState> starts(const std::vector<Vec3>& cloud) const;
  void add_frame(const Pose& pose, bool filled);

  Body body_;  // of the target, with weights by distance
  RegistrationOptions options_;
  Rig rig_;
  std::optional<RigState> previous_;  // fitted to the last cloud
  std::optional<Pose> shown_;         // of the target, for the last cloud
  int64_t missed_ = 0;                // frames of the source since the last cloud
  Joints source_joints_;
  SystemRig system_rig_{body_.joints, body_.weights};
  std::vector<RetargetedFrame> frames_;  // of the last push
};

}  // namespace restage
