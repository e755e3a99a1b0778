#include "extractors.h"

#include <cmath>

namespace bench {
namespace {

namespace nn = torch::nn;

constexpr int64_t kNeighbours = 16;

/// Rows of points [n, v, c] by index [n, ...], as one matrix: [n * ..., c]. As an embedding,
/// because its backward pass is 3 times as fast as that of gather and 10 times that of
/// index_select.
Tensor pick_rows(const Tensor& points, const Tensor& flat_index) {
  return torch::embedding(points.flatten(0, 1), flat_index);
}

/// Index [n, ...] into the points of each cloud -> index into the rows of all clouds, [n * ...].
Tensor flat(const Tensor& index, int64_t points) {
  std::vector<int64_t> shape(static_cast<size_t>(index.dim()), 1);
  shape[0] = -1;
  const Tensor first = torch::arange(index.size(0), torch::kLong).mul_(points).reshape(shape);
  return (index + first).flatten();
}

/// Rows of the nearest points: [n * m * k].
Tensor nearest(const Tensor& query, const Tensor& points) {
  torch::NoGradGuard no_grad;
  const int64_t k = std::min(kNeighbours, points.size(1));
  const Tensor index = std::get<1>(torch::cdist(query, points).topk(k, -1, false, true));
  return flat(index, points.size(1));
}

/// Farthest point sampling, from the point farthest from the centroid: rows [n * m].
Tensor farthest(const Tensor& x, int64_t m) {
  torch::NoGradGuard no_grad;
  const int64_t n = x.size(0);
  const Tensor rows = torch::arange(n, torch::kLong);
  Tensor current = (x - x.mean(1, true)).square_().sum(-1).argmax(1);
  Tensor distance = torch::full({n, x.size(1)}, 1e10);
  std::vector<Tensor> chosen;
  for (int64_t i = 0; i < m; ++i) {
    chosen.push_back(current);
    const Tensor centre = x.index({rows, current}).unsqueeze(1);
    torch::minimum_out(distance, distance, (x - centre).square_().sum(-1));
    current = distance.argmax(1);
  }
  return flat(torch::stack(chosen, 1), x.size(1));
}

/// `relu`: in place, between linear layers.
nn::Sequential chain(const std::vector<int64_t>& widths) {
  nn::Sequential out;
  for (size_t i = 0; i + 1 < widths.size(); ++i) {
    if (i > 0) out->push_back(nn::ReLU(nn::ReLUOptions(true)));
    out->push_back(nn::Linear(widths[i], widths[i + 1]));
  }
  return out;
}

nn::Linear without_bias(int64_t d) { return nn::Linear(nn::LinearOptions(d, d).bias(false)); }

/// The m farthest points, the nearest of each, two convolutions, maximum over the neighbours.
struct SetAbstraction : nn::Module {
  SetAbstraction(int64_t m, int64_t in, int64_t out) : m_(m) {
    for (int i = 0; i < 2; ++i) {
      mlp_convs->push_back(nn::Conv2d(i == 0 ? in : out, out, 1));
      mlp_bns->push_back(nn::BatchNorm2d(out));
    }
    register_module("mlp_convs", mlp_convs);
    register_module("mlp_bns", mlp_bns);
  }
  std::pair<Tensor, Tensor> forward(const Tensor& xyz, const Tensor& f) {
    const int64_t n = xyz.size(0);
    const Tensor centres = pick_rows(xyz, farthest(xyz, m_)).reshape({n, m_, 3});
    const Tensor rows = nearest(centres, xyz);
    const Tensor offsets = pick_rows(xyz, rows).reshape({n, m_, -1, 3}) - centres.unsqueeze(2);
    Tensor g = torch::cat({offsets, pick_rows(f, rows).reshape({n, m_, -1, f.size(2)})}, -1)
                   .permute({0, 3, 2, 1});  // [n, 3 + c, k, m]
    for (size_t i = 0; i < 2; ++i)
      g = mlp_bns[i]
              ->as<nn::BatchNorm2d>()
              ->forward(mlp_convs[i]->as<nn::Conv2d>()->forward(g))
              .relu_();
    return {centres, std::get<0>(g.max(2)).transpose(1, 2)};
  }
  int64_t m_;
  nn::ModuleList mlp_convs, mlp_bns;
};

struct TransitionDown : nn::Module {
  TransitionDown(int64_t m, int64_t in, int64_t out)
      : sa(register_module("sa", std::make_shared<SetAbstraction>(m, in, out))) {}
  std::shared_ptr<SetAbstraction> sa;
};

struct Backbone : nn::Module {
  Backbone(int64_t points, int64_t blocks, int64_t d, int64_t base)
      : fc1(chain({3, base, base})), transformer1(std::make_shared<VectorAttention>(base, d)) {
    register_module("fc1", fc1);
    register_module("transformer1", transformer1);
    for (int64_t i = 0, c = base; i < blocks; ++i, c *= 2) {
      points /= 4;
      transition_downs->push_back(std::make_shared<TransitionDown>(points, c + 3, 2 * c));
      transformers->push_back(std::make_shared<VectorAttention>(2 * c, d));
    }
    register_module("transition_downs", transition_downs);
    register_module("transformers", transformers);
  }
  Tensor forward(const Tensor& clouds) {
    Tensor xyz = clouds, f = transformer1->forward(xyz, fc1->forward(clouds));
    for (size_t i = 0; i < transformers->size(); ++i) {
      std::tie(xyz, f) = transition_downs->at<TransitionDown>(i).sa->forward(xyz, f);
      f = transformers->at<VectorAttention>(i).forward(xyz, f);
    }
    return f;
  }
  nn::Sequential fc1;
  std::shared_ptr<VectorAttention> transformer1;
  nn::ModuleList transition_downs, transformers;
};

struct PointTransformer : Extractor {
  PointTransformer()
      : backbone(register_module("backbone", std::make_shared<Backbone>(1024, 4, 512, 32))),
        fc2(register_module("fc2", chain({512, 256, 64, 3 * kJoints}))) {}
  Tensor forward(const Tensor& clouds) override {
    return fc2->forward(backbone->forward(clouds).mean(1)).reshape({-1, kJoints, 3});
  }
  std::shared_ptr<Backbone> backbone;
  nn::Sequential fc2;
};

/// T-net: 3 x 3 matrix of a cloud [n, 3, v].
struct SpatialTransformer : nn::Module {
  SpatialTransformer()
      : conv1(register_module("conv1", nn::Conv1d(3, 64, 1))),
        conv2(register_module("conv2", nn::Conv1d(64, 128, 1))),
        conv3(register_module("conv3", nn::Conv1d(128, 1024, 1))),
        fc1(register_module("fc1", nn::Linear(1024, 512))),
        fc2(register_module("fc2", nn::Linear(512, 256))),
        fc3(register_module("fc3", nn::Linear(256, 9))),
        bn1(register_module("bn1", nn::BatchNorm1d(64))),
        bn2(register_module("bn2", nn::BatchNorm1d(128))),
        bn3(register_module("bn3", nn::BatchNorm1d(1024))),
        bn4(register_module("bn4", nn::BatchNorm1d(512))),
        bn5(register_module("bn5", nn::BatchNorm1d(256))) {}
  Tensor forward(const Tensor& x) {
    Tensor h = bn1(conv1(x)).relu_();
    h = bn2(conv2(h)).relu_();
    h = std::get<0>(bn3(conv3(h)).relu_().max(2));
    h = bn4(fc1(h)).relu_();
    h = bn5(fc2(h)).relu_();
    return fc3(h).reshape({-1, 3, 3}) + torch::eye(3);
  }
  nn::Conv1d conv1, conv2, conv3;
  nn::Linear fc1, fc2, fc3;
  nn::BatchNorm1d bn1, bn2, bn3, bn4, bn5;
};

struct PointNet : Extractor {
  explicit PointNet(double dropout)
      : stn(register_module("stn", std::make_shared<SpatialTransformer>())),
        conv1(register_module("conv1", nn::Conv1d(3, 64, 1))),
        conv2(register_module("conv2", nn::Conv1d(64, 128, 1))),
        conv3(register_module("conv3", nn::Conv1d(128, 1024, 1))),
        bn1(register_module("bn1", nn::BatchNorm1d(64))),
        bn2(register_module("bn2", nn::BatchNorm1d(128))),
        bn3(register_module("bn3", nn::BatchNorm1d(1024))),
        fc1(register_module("fc1", nn::Linear(1024, 512))),
        fc2(register_module("fc2", nn::Linear(512, 256))),
        fc3(register_module("fc3", nn::Linear(256, 3 * kJoints))),
        bn4(register_module("bn4", nn::BatchNorm1d(512))),
        bn5(register_module("bn5", nn::BatchNorm1d(256))),
        drop(dropout) {}
  Tensor forward(const Tensor& clouds) override {
    Tensor x = clouds.matmul(stn->forward(clouds.transpose(1, 2))).transpose(1, 2);
    x = bn1(conv1(x)).relu_();
    x = bn2(conv2(x)).relu_();
    x = std::get<0>(bn3(conv3(x)).relu_().max(2));
    x = bn4(fc1(x)).relu_();
    x = bn5(drop(fc2(x))).relu_();
    return fc3(x).reshape({-1, kJoints, 3});
  }
  std::shared_ptr<SpatialTransformer> stn;
  nn::Conv1d conv1, conv2, conv3;
  nn::BatchNorm1d bn1, bn2, bn3;
  nn::Linear fc1, fc2, fc3;
  nn::BatchNorm1d bn4, bn5;
  nn::Dropout drop;
};

}  // namespace

VectorAttention::VectorAttention(int64_t c, int64_t d)
    : fc1(register_module("fc1", nn::Linear(c, d))),
      fc2(register_module("fc2", nn::Linear(d, c))),
      w_qs(without_bias(d)),
      w_ks(without_bias(d)),
      w_vs(without_bias(d)),
      fc_delta(register_module("fc_delta", chain({3, d, d}))),
      fc_gamma(register_module("fc_gamma", chain({d, d, d}))) {
  register_module("w_qs", w_qs);
  register_module("w_ks", w_ks);
  register_module("w_vs", w_vs);
}

// Tensors over pairs of points stay matrices [n * v * k, d], so that the bias is part of every
// product; what autograd does not keep is overwritten.
Tensor VectorAttention::forward(const Tensor& xyz, const Tensor& f) {
  const int64_t n = xyz.size(0), v = xyz.size(1), d = w_qs->options.out_features();
  const Tensor rows = nearest(xyz, xyz);
  const int64_t k = rows.numel() / (n * v);
  const Tensor h = fc1(f);
  const Tensor delta = fc_delta->forward(
      (xyz.unsqueeze(2) - pick_rows(xyz, rows).reshape({n, v, k, 3})).view({-1, 3}));
  const Tensor query = w_qs(h).view({n * v, 1, d});
  const Tensor score = (query - pick_rows(w_ks(h), rows).view({n * v, k, d})).view({-1, d});
  const Tensor e = fc_gamma->forward(score.add_(delta));
  const Tensor a = e.mul_(1 / std::sqrt(static_cast<double>(d))).view({n * v, k, d}).softmax(1);
  const Tensor value = pick_rows(w_vs(h), rows).add_(delta).view({n * v, k, d});
  return f + fc2((a * value).sum(1).view({n, v, d}));
}

std::shared_ptr<Extractor> point_transformer() { return std::make_shared<PointTransformer>(); }
std::shared_ptr<Extractor> pointnet(double dropout) { return std::make_shared<PointNet>(dropout); }

}  // namespace bench
