#include "nn/models/surface_turns.h"

#include "autograd/ops/layout.h"
#include "nn/geometry/closed_form.h"

namespace restage {
namespace {

Joints joints_at(const double* x) {
  Joints out;
  for (int j = 0; j < kJoints; ++j) out[j] = Eigen::Map<const Vec3>(x + 3 * j);
  return out;
}

Vec3 rotation_vector(const Mat3& r) {
  const Eigen::AngleAxisd turn(r);
  return turn.angle() * turn.axis();
}

}  // namespace

SurfaceTurns surface_turns(const MotionInput& in) {
  const int64_t n = in.joints.size(0), t = in.joints.size(1), leaves = std::ssize(kLeaves);
  SurfaceTurns out{Tensor::zeros({n * t, kJoints}, DType::f64),
                   Tensor::zeros({n * t, leaves, 3, 3}, DType::f64),
                   Tensor::zeros({n * t, 3 * kJoints}, DType::f64)};
  for (int64_t k = 0; k < n * t * leaves; ++k)
    matrix_at(out.leaves.data<double>() + 9 * k).setIdentity();
  if (in.turns.defined()) {
    const Tensor joints = in.joints.value.cpu().cast(DType::f64),
                 rest = in.rest.value.cpu().cast(DType::f64),
                 turns = in.turns.cpu().cast(DType::f64);
    for (int64_t k = 0; k < n * t; ++k) {
      Rotations measured;
      for (int j = 0; j < kJoints; ++j)
        measured[j] = matrix_at(turns.data<double>() + 9 * (k * kJoints + j));
      const TwistReading read =
          read_twist(joints_at(rest.data<double>() + 3 * kJoints * (k / t)),
                     joints_at(joints.data<double>() + 3 * kJoints * k), measured);
      for (int j = 0; j < kJoints; ++j) {
        out.twist.data<double>()[k * kJoints + j] = read.twist[j];
        Eigen::Map<Vec3>(out.beyond.data<double>() + 3 * (k * kJoints + j)) =
            rotation_vector(read.beyond[j]);
      }
      for (int64_t i = 0; i < leaves; ++i)
        matrix_at(out.leaves.data<double>() + 9 * (k * leaves + i)) = read.beyond[kLeaves[i]];
    }
  }
  for (Tensor* x : {&out.twist, &out.leaves, &out.beyond})
    *x = x->cast(in.joints.dtype()).to(in.joints.value.device());
  return out;
}

Var with_leaves(const Var& rotations, const Var& leaves) {
  Var out;
  int done = 0;
  const auto append = [&](const Var& x) { out = out.value.defined() ? concat({out, x}, 1) : x; };
  for (int i = 0; i < static_cast<int>(kLeaves.size()); ++i) {
    if (kLeaves[i] > done) append(slice(rotations, 1, done, kLeaves[i]));
    append(slice(leaves, 1, i, i + 1));
    done = kLeaves[i] + 1;
  }
  if (done < kJoints) append(slice(rotations, 1, done, kJoints));
  return out;
}

}  // namespace restage
