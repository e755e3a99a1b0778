#include "nn/models/closed_form_motion.h"

#include "nn/geometry/closed_form.h"

namespace restage {
namespace {

Joints joints_at(const Tensor& rows, int64_t row) {
  Joints out;
  const double* p = rows.data<double>() + 3 * kJoints * row;
  for (int j = 0; j < kJoints; ++j) out[j] = Eigen::Map<const Vec3>(p + 3 * j);
  return out;
}

}  // namespace

MotionOutput ClosedFormMotion::forward(Context&, const Var& joints, const Var& trans,
                                       const Var& rest, MotionState* state) const {
  const int64_t n = joints.size(0), t = joints.size(1);
  const Tensor a = joints.value.cast(DType::f64), b = rest.value.cast(DType::f64);
  Tensor path = trans.value.cast(DType::f64).clone();
  if (state->empty()) {
    Tensor scale = Tensor::empty({n}, DType::f64);
    for (int64_t s = 0; s < n; ++s)
      scale.data<double>()[s] = trajectory_scale(joints_at(a, s * t), joints_at(b, s));
    state->emplace_back(scale);
  }
  Tensor raw = Tensor::empty({n, t, 6 * kJoints}, DType::f64),
         local = Tensor::empty({n, t, kJoints, 3, 3}, DType::f64),
         posed = Tensor::empty({n, t, kJoints, 3}, DType::f64);
  for (int64_t row = 0; row < n * t; ++row) {
    const int64_t s = row / t;
    const Joints target = joints_at(b, s);
    Pose pose;
    pose.local = to_local(closed_form_rotations(target, joints_at(a, row)));
    pose.root = Vec3::Zero();
    const Joints moved = forward_kinematics(target, pose).joints;
    for (int j = 0; j < kJoints; ++j) {
      const int64_t at = row * kJoints + j;
      Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(local.data<double>() + 9 * at) =
          pose.local[j];
      Eigen::Map<Eigen::Matrix<double, 3, 2>>(raw.data<double>() + 6 * at) =
          pose.local[j].leftCols<2>();
      Eigen::Map<Vec3>(posed.data<double>() + 3 * at) = moved[j];
    }
    Eigen::Map<Vec3>(path.data<double>() + 3 * row) *= state->front().value.data<double>()[s];
  }
  return {Var(raw.cast(type)), Var(local.cast(type)), Var(posed.cast(type)), Var(path.cast(type))};
}

}  // namespace restage
