#include "nn/models/closed_form_motion.h"

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/rotation.h"
#include "autograd/ops/swing.h"
#include "nn/models/surface_turns.h"

namespace restage {

MotionOutput ClosedFormMotion::forward(Context&, const MotionInput& in, MotionState* state) const {
  const Var &joints = in.joints, &rest = in.rest;
  const int64_t n = joints.size(0), t = joints.size(1);
  const Var posed = reshape(joints, {n * t, kJoints, 3}), rows = rest_of_each_frame(rest, t);
  const SurfaceTurns surface = surface_turns(in);
  if (state->empty()) {
    const Var first = reshape(slice(joints, 1, 0, 1), {n, kJoints, 3});
    state->push_back(reshape(leg_lengths(rest) / leg_lengths(first), {n, 1, 1}));
  }
  MotionOutput out;
  const Var local = with_leaves(swing_twist(rows, posed, Var(surface.twist), joint_swings()),
                                Var(surface.leaves));
  out.raw = reshape(matrix_to_sixd(local), {n, t, 6 * kJoints});
  put_pose(local, rows, n, &out);
  out.trans = in.trans * state->front();
  return out;
}

}  // namespace restage
