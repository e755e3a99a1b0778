// The two extractors of skeletons, with PyTorch's names and the papers' sizes.
#pragma once

#include <torch/torch.h>

#include "geometry.h"

namespace bench {

/// Something that makes joints [n, 22, 3] of clouds [n, 1024, 3].
struct Extractor : torch::nn::Module {
  virtual Tensor forward(const Tensor& clouds) = 0;
};

/// Vector attention over the 16 nearest neighbours.
struct VectorAttention : torch::nn::Module {
  VectorAttention(int64_t c, int64_t d);
  Tensor forward(const Tensor& xyz, const Tensor& f);
  torch::nn::Linear fc1{nullptr}, fc2{nullptr}, w_qs{nullptr}, w_ks{nullptr}, w_vs{nullptr};
  torch::nn::Sequential fc_delta, fc_gamma;
};

/// The 3DV paper's: 9,585,730 parameters.
std::shared_ptr<Extractor> point_transformer();
constexpr int64_t kPointTransformerParameters = 9585730;
/// The first version's: 1,620,811 parameters. `dropout` 0.3.
std::shared_ptr<Extractor> pointnet(double dropout);
constexpr int64_t kPointNetParameters = 1620811;

}  // namespace bench
