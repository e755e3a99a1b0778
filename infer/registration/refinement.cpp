#include "infer/registration/refinement.h"

#include "infer/registration/registration.h"
#include "nn/geometry/closed_form.h"

namespace restage {
namespace {

/// The start is near the answer, so the kernel begins with the width of a hand's length.
ArticulatedOptions near() {
  ArticulatedOptions out;
  out.iterations = 15;
  out.widest = 0.12;
  return out;
}

}  // namespace

void Refinement::check_frame_by_frame(const std::string& where) const {
  if (!frame_by_frame())
    throw InputError(
        where, "is to be refined from a source that is resampled, or by weights that look ahead",
        "use the system 'chain', or a source of 30 frames per second");
}

void Refinement::answer(const Points& cloud, const std::string& source, const Show& show) {
  points_ = thinned(cloud, kCloudGrid, source);
  Retargeter::answer(cloud, source, show);
}

void Refinement::adjust(RetargetedFrame& frame) {
  if (frame.filled) return;
  const Joints& seen = *Retargeter::source_joints();
  RigState start;
  start.pose = frame.pose;
  start.pose.root = seen[0];
  start.scale = 1 / trajectory_scale(seen, rest());
  const RigState fitted = fit_articulated(fitted_rig_, points_, start, near());
  source_joints_ = forward_kinematics(built(rest(), fitted), fitted.pose).joints;
  // Rotations are those of the fit. The pelvis stays where the chain put it: the chain's path
  // follows the source's path over time (RetargetOptions::anchor).
  const Vec3 root = frame.pose.root;
  frame.pose = fitted.pose;
  frame.pose.root = root;
}

}  // namespace restage
