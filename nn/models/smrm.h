// `smrm/rot6d`, `smrm/quaternion`: the skeletal motion retargeting network (spec 3).
#pragma once

#include "autograd/kernels/rotation.h"
#include "nn/config/rules.h"
#include "nn/layers/gru.h"
#include "nn/layers/linear.h"
#include "nn/models/motion.h"

namespace restage {

struct SmrmConfig {
  RotationForm rotation = RotationForm::sixd;  ///< or RotationForm::quaternion (the first version)
  int64_t hidden = 512;
  int layers = 2;
  double dropout = 0.2;
  /// Inputs and translation are in units of the training set's deviation.
  bool standardise = false;
  bool rest_pose_start = false;  ///< first output near the rest pose (spec 3.4)
  int64_t joints = kJoints;
};

template <class V>
void visit(V& v, SmrmConfig& c) {
  v("hidden", c.hidden, "size of the hidden states", between(1, kMostWidth));
  v("dropout", c.dropout, "between the layers", below(0, 1));
  v("standardise", c.standardise, "inputs in units of the training set's deviation");
  v("rest_pose_start", c.rest_pose_start, "first output near the rest pose");
  v("layers", c.layers, "of the encoder and of the decoder", added("2", between(1, 16)));
}

/// The state is {encoder, decoder}, both [layers, n, hidden].
struct Smrm final : MotionModel {
  using Config = SmrmConfig;
  Smrm(const SmrmConfig& c, const Init& init);
  MotionOutput forward(Context& ctx, const MotionInput& in, MotionState* state) const override;
  void standardise(const MotionStatistics& statistics) override;
  void visit(Fields& f) override;
  const char* kind() const override { return "SMRM"; }
  SmrmConfig config;
  GruLayer enc, dec;
  Linear fc_rot, fc_trans;
  // Standardisation (only with config.standardise): mean and deviation of joints, rest,
  // translation.
  Tensor joint_mean, joint_std, rest_mean, rest_std, trans_mean, trans_std, rot_mean, rot_std;
};

}  // namespace restage
