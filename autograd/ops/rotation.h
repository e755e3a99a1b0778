// Rotations, forward kinematics and linear blend skinning (spec 3.4, 3.5, 5.2).
#pragma once

#include "autograd/kernels/rotation.h"
#include "autograd/kernels/scratch.h"
#include "autograd/tape/tape.h"

namespace restage {

/// x [..., 6 | 4 | 3] -> matrices [..., 3, 3]. 6D: the first two columns before orthonormalisation;
/// quaternions (w, x, y, z) are normalised; axis-angle in radians.
struct ToMatrix {
  static constexpr const char* name = "to_matrix";
  static constexpr const char* letters = "x[..., 6 | 4 | 3]";
  RotationForm form = RotationForm::sixd;
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

/// Local rotations, rest joints and posed root -> [n, j, 3, 4], per joint [global rotation |
/// position].
struct ForwardKinematics {
  static constexpr const char* name = "forward_kinematics";
  static constexpr const char* letters = "R[n, j, 3, 3], rest[n, j, 3], root[n, 3]";
  Scratch<int> parents;  ///< -1 for the root; parents come before children
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

/// y = sum_j W_j (G_j (x - rest_j) + P_j) with [G | P] from forward_kinematics.
struct LinearBlendSkinning {
  static constexpr const char* name = "linear_blend_skinning";
  static constexpr const char* letters = "x[n, v, 3], W[n, v, j], T[n, j, 3, 4], rest[n, j, 3]";
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

inline Var sixd_to_matrix(const Var& x) { return call(ToMatrix{RotationForm::sixd}, {x}); }
inline Var quaternion_to_matrix(const Var& x) {
  return call(ToMatrix{RotationForm::quaternion}, {x});
}
inline Var axis_angle_to_matrix(const Var& x) {
  return call(ToMatrix{RotationForm::axis_angle}, {x});
}
/// [..., 3, 3] -> [..., 6], the first two columns.
Var matrix_to_sixd(const Var& r);
/// [..., 3, 3] -> [..., 4] with w >= 0, and [..., 3] with angle in [0, pi]. No gradient.
Tensor matrix_to_quaternion(const Tensor& r);
Tensor matrix_to_axis_angle(const Tensor& r);

inline Var forward_kinematics(const Var& local, const Var& rest, const Var& root,
                              std::span<const int> parents) {
  return call(ForwardKinematics{{parents.begin(), parents.end()}}, {local, rest, root});
}
/// Positions [n, j, 3] and global rotations [n, j, 3, 3] of forward_kinematics' result.
Var joints_of(const Var& transforms);
Var rotations_of(const Var& transforms);
inline Var linear_blend_skinning(const Var& points, const Var& weights, const Var& transforms,
                                 const Var& rest) {
  return call(LinearBlendSkinning{}, {points, weights, transforms, rest});
}

}  // namespace restage
