// 3D-CoreNet (transfers.h).
#include "transfers.h"

namespace bench {
namespace {

namespace nn = torch::nn;

constexpr double kLeak = 0.2;

nn::Conv1d pointwise(int64_t in, int64_t out) { return nn::Conv1d(in, out, 1); }

/// In place.
Tensor leaky(Tensor x) { return torch::leaky_relu_(x, kLeak); }

/// x over the length of its channels. (A product's backward pass is faster than a quotient's.)
Tensor unit_channels(const Tensor& x) {
  return x * (x.norm(2, 1, true) + std::numeric_limits<double>::epsilon()).reciprocal_();
}

struct ResBlock : nn::Module {
  explicit ResBlock(int64_t c)
      : conv1(register_module("conv1", pointwise(c, c))),
        conv2(register_module("conv2", pointwise(c, c))),
        act(register_module("act", nn::PReLU())) {}
  Tensor forward(const Tensor& x) {
    const Tensor inner = act(instance_norm(map(conv1, x)));
    return act(instance_norm(map(conv2, inner)).add_(x));
  }
  nn::Conv1d conv1, conv2;
  nn::PReLU act;
};

/// The shares [v, p] of the pose's points in each of the target's, five steps of Sinkhorn's. Items
/// one by one, because products of matrices and vectors are slower in batches.
Tensor transport(const Tensor& similarity) {
  const double row = 1.0 / static_cast<double>(similarity.size(0)),
               column = 1.0 / static_cast<double>(similarity.size(1));
  const Tensor kernel = (similarity - 1).mul_(1 / 0.03).exp_();
  Tensor a = torch::full({similarity.size(0)}, row), b;
  for (int i = 0; i < 5; ++i) {
    b = torch::mv(kernel.t(), a).add_(1e-8).reciprocal().mul(column);
    a = torch::mv(kernel, b).add_(1e-8).reciprocal().mul(row);
  }
  const Tensor plan = a.unsqueeze(1) * kernel * b;
  return plan * plan.sum(1, true).reciprocal_();
}

struct Correspondence : nn::Module {
  explicit Correspondence(const Widths& widths)
      : phi(register_module("phi", pointwise(widths[2], widths[2]))),
        theta(register_module("theta", pointwise(widths[2], widths[2]))) {
    int64_t in = 3;
    for (const int64_t w : widths) {
      convs->push_back(pointwise(in, w));
      in = w;
    }
    for (int i = 0; i < 4; ++i) res->push_back(std::make_shared<ResBlock>(in));
    register_module("convs", convs);
    register_module("res", res);
  }
  Tensor features(Tensor x) {
    for (size_t i = 0; i < 3; ++i) {
      if (i > 0) x = leaky(x);
      x = instance_norm(map(conv_of(convs, i), x));
    }
    x = unit_channels(x);
    for (size_t i = 0; i < res->size(); ++i) x = res->at<ResBlock>(i).forward(x);
    return x;
  }
  nn::Conv1d phi, theta;
  nn::ModuleList convs, res;
};

/// Scale and shift lie between what the target's features ask for and x's own deviation and mean.
struct Elain : nn::Module {
  Elain(int64_t c, int64_t features)
      : same(register_module("same", pointwise(features, c))),
        gamma(register_module("gamma", pointwise(c, c))),
        beta(register_module("beta", pointwise(c, c))),
        mix(register_module("mix", pointwise(2 * c, c))) {}
  Tensor forward(const Tensor& x, const Tensor& features) {
    Tensor variance, m;
    std::tie(variance, m) = torch::var_mean(x, 2, true, true);
    const Tensor s = (variance + 1e-5).sqrt_();
    const Tensor asked = map(same, features);
    const Tensor share = map(mix, torch::cat({asked.mean(2, true), m}, 1)), rest = 1 - share;
    const Tensor scale = torch::addcmul(s * rest + 1, map(gamma, asked), share);
    const Tensor shift = torch::addcmul(m * rest, map(beta, asked), share);
    return torch::addcmul(shift, (x - m) * s.reciprocal(), scale);
  }
  nn::Conv1d same, gamma, beta, mix;
};

/// Weight over its largest singular value, which one power iteration a step follows.
struct SpectralConv : nn::Module {
  SpectralConv(int64_t c, bool with_bias)
      : weight(register_parameter("weight_orig", torch::empty({c, c, 1}))),
        u(register_buffer("weight_u", torch::empty({c}))),
        v(register_buffer("weight_v", torch::empty({c}))) {
    if (with_bias) bias = register_parameter("bias", torch::empty({c}));
  }
  Tensor forward(const Tensor& x) {
    const Tensor w = weight.squeeze(2);
    {
      torch::NoGradGuard no_grad;
      const auto options = nn::functional::NormalizeFuncOptions().dim(0).eps(1e-12);
      v.copy_(nn::functional::normalize(torch::mv(w.t(), u), options));
      u.copy_(nn::functional::normalize(torch::mv(w, v), options));
    }
    const Tensor scaled = w / torch::dot(u.clone(), torch::mv(w, v.clone()));
    const Tensor each = scaled.expand({x.size(0), -1, -1});
    return bias.defined() ? torch::baddbmm(bias.view({1, -1, 1}), each, x) : torch::bmm(each, x);
  }
  Tensor weight, bias, u, v;
};

struct ElainBlock : nn::Module {
  ElainBlock(int64_t c, int64_t features)
      : n0(register_module("n0", std::make_shared<Elain>(c, features))),
        n1(register_module("n1", std::make_shared<Elain>(c, features))),
        ns(register_module("ns", std::make_shared<Elain>(c, features))),
        c0(register_module("c0", std::make_shared<SpectralConv>(c, true))),
        c1(register_module("c1", std::make_shared<SpectralConv>(c, true))),
        cs(register_module("cs", std::make_shared<SpectralConv>(c, false))) {}
  Tensor forward(const Tensor& x, const Tensor& f) {
    const Tensor h = c0->forward(leaky(n0->forward(x, f)));
    const Tensor past = cs->forward(leaky(ns->forward(x, f)));
    return c1->forward(leaky(n1->forward(h, f))).add_(past);
  }
  std::shared_ptr<Elain> n0, n1, ns;
  std::shared_ptr<SpectralConv> c0, c1, cs;
};

struct CoreNet : Poser {
  CoreNet(const Widths& widths, const Widths& generator)
      : corr(register_module("corr", std::make_shared<Correspondence>(widths))),
        fc(register_module("fc", nn::Conv1d(nn::Conv1dOptions(3, generator[0], 3).padding(1)))),
        out(register_module("out", pointwise(generator[2], 3))) {
    int64_t in = generator[0];
    for (const int64_t c : generator) {
      convs->push_back(pointwise(in, c));
      blocks->push_back(std::make_shared<ElainBlock>(c, widths[2]));
      in = c;
    }
    register_module("convs", convs);
    register_module("blocks", blocks);
  }
  Tensor forward(const Tensor& pose, const Tensor& target) override {
    const Tensor f = corr->features(target);
    const Tensor q = unit_channels(map(corr->theta, f));
    const Tensor k = unit_channels(map(corr->phi, corr->features(pose)));
    std::vector<Tensor> warped;
    for (int64_t i = 0; i < q.size(0); ++i)
      warped.push_back(torch::mm(pose[i], transport(torch::mm(q[i].t(), k[i])).t()));
    Tensor x = fc(torch::stack(warped));
    for (size_t i = 0; i < convs->size(); ++i) {
      x = blocks->at<ElainBlock>(i).forward(map(conv_of(convs, i), x), f);
    }
    return map(out, x).tanh_().mul(2);
  }
  std::shared_ptr<Correspondence> corr;
  nn::Conv1d fc, out;
  nn::ModuleList convs, blocks;
};

}  // namespace

std::shared_ptr<Poser> corenet(const Widths& widths, const Widths& generator) {
  return std::make_shared<CoreNet>(widths, generator);
}

}  // namespace bench
