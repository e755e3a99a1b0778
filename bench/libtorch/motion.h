// The motion retargeting network and the deformation networks.
#pragma once

#include <torch/torch.h>

#include "geometry.h"

namespace bench {

struct SmrmOutput {
  Tensor rotations, joints, trans;  ///< [n, t, 22, 3, 3] local, [n, t, 22, 3], [n, t, 3]
};

/// Encoder and decoder GRUs of two layers, 512 wide: 5,793,927 parameters.
struct Smrm : torch::nn::Module {
  explicit Smrm(double dropout);
  /// joints [n, t, 22, 3], trans [n, t, 3], rest [n, 22, 3]; the states are read and replaced.
  SmrmOutput forward(const Tensor& joints, const Tensor& trans, const Tensor& rest,
                     Tensor* encoder_state, Tensor* decoder_state);
  torch::nn::GRU enc{nullptr}, dec{nullptr};
  torch::nn::Linear fc_rot{nullptr}, fc_trans{nullptr};
};
constexpr int64_t kSmrmParameters = 5793927;

/// One batch of windows, as restage_bench wrote it.
struct Windows {
  Tensor joints, trans, rest_a, rest_b, sixd, self_mask;
};
/// A to B and back to A: cycle, rotation, smoothness and self-reconstruction.
Tensor motion_loss(Smrm& net, const Windows& w);

/// 69 -> 256 -> 256 -> out, dropout before every ReLU: W_net 89,366 and O_net 84,483 parameters.
struct Mlp : torch::nn::Module {
  Mlp(int64_t out, double dropout, bool softmax);
  /// A vector per sample [n, 66] with every point [n, v, 3].
  Tensor forward(const Tensor& vector, const Tensor& points);
  torch::nn::Linear fc1{nullptr}, fc2{nullptr}, fc3{nullptr};
  torch::nn::Dropout drop;
  bool with_softmax;
};
constexpr int64_t kWeightsParameters = 89366, kOffsetsParameters = 84483;

}  // namespace bench
