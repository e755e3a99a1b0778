// `smrm/rot6d`, `smrm/quaternion`: the skeletal motion retargeting network (spec 3).
#pragma once

#include "autograd/kernels/rotation.h"
#include "nn/geometry/skeleton.h"
#include "nn/layers/gru.h"
#include "nn/layers/linear.h"

namespace restage {

struct SmrmConfig {
  RotationForm rotation = RotationForm::sixd;  ///< or quaternion (the first version)
  int64_t hidden = 512;
  int layers = 2;
  double dropout = 0.2;
  bool standardise = false;  ///< inputs and translation in units of the training set's deviation
  bool rest_pose_start = false;  ///< first output near the rest pose (spec 3.4)
  int64_t joints = kJoints;
};

/// Hidden states carried from frame to frame, both [layers, n, hidden]; undefined at the start.
struct SmrmState {
  Var encoder, decoder;
};

struct SmrmOutput {
  Var raw;        ///< [n, t, 22 * (6 | 4)] before orthonormalisation
  Var rotations;  ///< [n, t, 22, 3, 3] local
  Var joints;     ///< [n, t, 22, 3] relative to the root, metres
  Var trans;      ///< [n, t, 3], in the configured meaning (velocity: m/s)
};

struct Smrm : Module {
  Smrm(const SmrmConfig& c, const Init& init);
  /// joints [n, t, 22, 3] of A relative to its root; trans [n, t, 3]; rest [n, 22, 3] of B relative
  /// to its root. `state` is read and replaced.
  SmrmOutput operator()(Context& ctx, const Var& joints, const Var& trans, const Var& rest,
                        SmrmState* state) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "SMRM"; }
  SmrmConfig config;
  GruLayer enc, dec;
  Linear fc_rot, fc_trans;
  // Standardisation (only with config.standardise): mean and deviation of joints, rest,
  // translation.
  Tensor joint_mean, joint_std, rest_mean, rest_std, trans_mean, trans_std, rot_mean, rot_std;
};

/// Parents of the 22 joints as the kinematics op takes them.
inline std::span<const int> joint_parents() { return kParents; }

}  // namespace restage
