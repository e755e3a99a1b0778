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

Refinement::Refinement(std::unique_ptr<Retargeter> chain, const std::string& where)
    : chain_(std::move(chain)), rig_(make_rig(chain_->target(), chain_->rest(), where)) {
  if (!chain_->frame_by_frame())
    throw InputError(
        where, "is to be refined from a source that is resampled, or by weights that look ahead",
        "use the system 'chain', or a source of 30 frames per second");
}

std::span<const RetargetedFrame> Refinement::push(const Points& cloud, const std::string& source) {
  const std::vector<Vec3> points = thinned(cloud, kCloudGrid, source);
  const std::span<const RetargetedFrame> answers = chain_->push(cloud, source);
  if (answers.empty()) return answers;
  // Frames of a gap before this cloud cannot be fitted, as they have no cloud: they stay as the
  // chain gave them.
  frames_.assign(answers.begin(), answers.end());
  RetargetedFrame& frame = frames_.back();
  const Joints& seen = *chain_->source_joints();
  RigState start;
  start.pose = frame.pose;
  start.pose.root = seen[0];
  start.scale = 1 / trajectory_scale(seen, chain_->rest());
  const RigState fitted = fit_articulated(rig_, points, start, near());
  source_joints_ = forward_kinematics(built(chain_->rest(), fitted), fitted.pose).joints;
  // Rotations are those of the fit. The pelvis stays where the chain put it: the chain's path
  // follows the source's path over time (RetargetOptions::anchor).
  const Vec3 root = frame.pose.root;
  frame.pose = fitted.pose;
  frame.pose.root = root;
  frame.joints = forward_kinematics(chain_->rest(), frame.pose).joints;
  frame.vertices = chain_->posed(frame.pose);
  return frames_;
}

}  // namespace restage
