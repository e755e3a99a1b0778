// The systems that pose a mesh without a skeleton, with PyTorch's names. Channels come before
// points: clouds and meshes are [n, 3, v].
#pragma once

#include <torch/torch.h>

#include <array>
#include <memory>

namespace bench {

using torch::Tensor;
using Widths = std::array<int64_t, 3>;

/// Vertices [n, 3, v] of the targets in the poses of clouds [n, 3, p], one for each.
struct Poser : torch::nn::Module {
  virtual Tensor forward(const Tensor& pose, const Tensor& target) = 0;
};

/// NPT with the pose pooled: 6,054,941 parameters at widths 64, 128, 1024.
std::shared_ptr<Poser> npt(const Widths& widths);
/// 3D-CoreNet: 24,461,447 parameters at 64, 128, 256 and 1024, 512, 256.
std::shared_ptr<Poser> corenet(const Widths& widths, const Widths& generator);

/// Answers of windows, through codes that can be mixed.
struct WindowPoser : torch::nn::Module {
  /// Codes [n, t, c] of windows [n, t, 3, p].
  virtual Tensor codes(const Tensor& pose) = 0;
  /// Targets [n, 3, v] in the poses of codes [n, t, c]: [n * t, 3, v]. What depends on the target
  /// alone is done once for all t.
  virtual Tensor decode(const Tensor& codes, const Tensor& target) = 0;
};

/// LART: 12,012,423 parameters at 64, 128, 1024.
std::shared_ptr<WindowPoser> lart(const Widths& widths);

/// Attention of queries over keys [n, c, points], without a factor: values [n, d, points] mixed.
Tensor attend(const Tensor& queries, const Tensor& keys, const Tensor& values);

torch::nn::Conv1d conv_of(const torch::nn::ModuleList& list, size_t i);
/// 1x1 convolution of x [n, c, v].
Tensor map(const torch::nn::Conv1d& layer, const Tensor& x);
/// x [n, c, v] over the points of each item and channel.
Tensor instance_norm(const Tensor& x);

}  // namespace bench
