#include "nn/models/motion.h"

#include <array>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"
#include "autograd/ops/rotation.h"

namespace restage {

std::span<const SwingJoint> joint_swings() {
  static const std::vector<SwingJoint> table = [] {
    std::vector<SwingJoint> out(kJoints);
    for (int j = kJoints - 1; j >= 0; --j) {
      out[j].parent = kParents[j];
      if (kParents[j] >= 0) out[kParents[j]].child = j;  // the first child stays in the end
    }
    out[0] = {-1, 3, 1, 2};    // spine1, left hip, right hip
    out[9] = {6, 12, 13, 14};  // spine3: neck, left collar, right collar
    return out;
  }();
  return table;
}

MotionInput moved(MotionInput in, Device device) {
  for (Var* x : {&in.joints, &in.trans, &in.rest}) x->value = x->value.to(device);
  for (Tensor* x : {&in.turns, &in.uncertainty, &in.reframed}) *x = x->to(device);
  return in;
}

MotionOutput on_host(const MotionOutput& out) {
  return {out.raw.value.cpu(), out.rotations.value.cpu(), out.joints.value.cpu(),
          out.trans.value.cpu(), out.standing.value.cpu()};
}

MotionOutput frames_of(const MotionOutput& out, int64_t from, int64_t to) {
  const auto part = [&](const Var& x) { return x.value.defined() ? slice(x, 1, from, to) : x; };
  return {part(out.raw), part(out.rotations), part(out.joints), part(out.trans),
          part(out.standing)};
}

Var in_units(const Var& x, const MotionStatistics::Columns& of) {
  return (x - Var(of.mean)) / Var(of.deviation);
}

Var rest_of_each_frame(const Var& rest, int64_t frames) {
  const int64_t n = rest.size(0);
  return reshape(expand(reshape(rest, {n, 1, kJoints, 3}), {n, frames, kJoints, 3}),
                 {n * frames, kJoints, 3});
}

Var leg_lengths(const Var& joints) {
  const Var hips = slice(joints, 1, 1, 3), knees = slice(joints, 1, 4, 6),
            ankles = slice(joints, 1, 7, 9);
  return mean(smooth_length(hips - knees, 1e-20) + smooth_length(knees - ankles, 1e-20), 1);
}

void put_pose(const Var& local, const Var& rest_rows, int64_t n, MotionOutput* out) {
  const int64_t t = local.size(0) / std::max<int64_t>(1, n);
  const Tensor origin = Tensor::zeros({n * t, 3}, local.dtype(), local.value.device());
  const Var posed = forward_kinematics(local, rest_rows, origin, joint_parents());
  out->rotations = reshape(local, {n, t, kJoints, 3, 3});
  out->joints = reshape(joints_of(posed), {n, t, kJoints, 3});
}

}  // namespace restage
