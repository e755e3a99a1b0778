// "Register then repose", the classical way to retarget without correspondences; a reference for
// the learned system (docs/benchmark.md). The target's T-pose is registered to every cloud of the
// source, and the target then performs the rotations that the registration found.
//
//   start    candidates: several headings and arm poses, and the pose of the frame before; the best
//            few are fitted
//   articulated ICP (articulated.h): finds pose, size and bone lengths
//   free-form ICP (free_form.h): follows differences of shape
//   repose   the target's own bones, with the rotations of the registered parts; the path of the
//            pelvis is scaled by the length of the legs, as in nn/geometry/closed_form.h
//
// There is no network and there are no learned weights. The user gives the target's 22 rest joints,
// as the rig of a character has them. The limits are those of every such method: the search of a
// frame may end in a wrong optimum (front and back exchanged, arms in the trunk, legs crossed),
// points of one frame are not matched with points of the next, and a frame takes seconds.
#pragma once

#include <optional>
#include <string>

#include "infer/each_cloud.h"
#include "infer/registration/free_form.h"

namespace restage {

/// A cloud with fewer points: of all points in a cube of a grid of that width (metres) the mean, in
/// the order of the cubes. UnusableCloud naming `source`: fewer than 64 cubes hold points, or
/// values are not finite.
std::vector<Vec3> thinned(const Points& cloud, double width, const std::string& source);

inline constexpr double kCloudGrid = 0.03;

struct RegistrationOptions {
  size_t nodes = kRigNodes;
  int searched = 12;         ///< candidates that are fitted, besides the pose of the frame before
  double grid = kCloudGrid;  ///< width for thinned()
  bool free_form = true;
  ArticulatedOptions articulated;
  FreeFormOptions free_form_options;
};

class Registration final : public EachCloud {
 public:
  /// `where` names the target in errors. InputError: see make_rig().
  Registration(Mesh target, const Joints& rest, const std::string& where,
               const RegistrationOptions& options = {});

  /// The joints of the target as registered to the last cloud: in the pose and of the build of the
  /// source.
  const Joints* source_joints() const override { return &source_joints_; }
  const Mesh& target() const override { return body_.rest; }
  const Joints* target_joints() const override { return &body_.joints; }

 private:
  /// The same bits for any number of threads. UnusableCloud: see thinned().
  void answer(const Points& cloud, const std::string& source, const Show& show) override;
  void forget() override;
  void place(RetargetedFrame& frame) const override { place_body(body_, frame); }
  std::vector<RigState> starts(const std::vector<Vec3>& cloud) const;

  Body body_;  // the target, with bone_distance_weights()
  RegistrationOptions options_;
  Rig rig_;
  std::optional<RigState> previous_;  // fitted to the last cloud
  Joints source_joints_;
  RetargetedFrame frame_;  // of the last cloud
};

}  // namespace restage
