#include "transfers.h"

namespace bench {
namespace {

namespace nn = torch::nn;

nn::Conv1d conv(int64_t in, int64_t out) { return nn::Conv1d(in, out, 1); }

/// Answers lie within 2 m of the origin.
Tensor points_of(const nn::Conv1d& out, const Tensor& x) { return map(out, x).tanh_().mul(2); }

}  // namespace

torch::nn::Conv1d conv_of(const torch::nn::ModuleList& list, size_t i) {
  return torch::nn::Conv1d(std::dynamic_pointer_cast<torch::nn::Conv1dImpl>(list->ptr(i)));
}

// As a product of matrices, whose bias is part of it.
Tensor map(const torch::nn::Conv1d& layer, const Tensor& x) {
  const Tensor each = layer->weight.squeeze(2).expand({x.size(0), -1, -1});
  return torch::baddbmm(layer->bias.view({1, -1, 1}), each, x);
}

Tensor instance_norm(const Tensor& x) {
  return torch::instance_norm(x, {}, {}, {}, {}, true, 0, 1e-5, false);
}

Tensor attend(const Tensor& queries, const Tensor& keys, const Tensor& values) {
  const Tensor shares = torch::bmm(queries.transpose(1, 2), keys).softmax(2);
  return torch::bmm(values, shares.transpose(1, 2));
}

namespace {

struct PoseEncoder : nn::Module {
  explicit PoseEncoder(const Widths& widths) {
    int64_t in = 3;
    for (const int64_t w : widths) {
      convs->push_back(conv(in, w));
      in = w;
    }
    register_module("convs", convs);
  }
  Tensor forward(Tensor x) {
    for (size_t i = 0; i < 3; ++i) x = instance_norm(map(conv_of(convs, i), x)).relu_();
    return x;
  }
  nn::ModuleList convs;
};

/// Scale of the mesh times x + shift of the mesh; x is normalised where it is not one code.
struct Spadain : nn::Module {
  Spadain(int64_t c, bool norm)
      : scale(register_module("scale", conv(3, c))),
        shift(register_module("shift", conv(3, c))),
        with_norm(norm) {}
  /// `unit`: x, normalised if this wants it.
  Tensor forward(const Tensor& unit, const Tensor& mesh) {
    return torch::addcmul(map(shift, mesh), map(scale, mesh), unit);
  }
  Tensor unit(const Tensor& x) const { return with_norm ? instance_norm(x) : x; }
  nn::Conv1d scale, shift;
  bool with_norm;
};

struct SpadainBlock : nn::Module {
  SpadainBlock(int64_t c, bool norm) : c1(conv(c, c)), c2(conv(c, c)), c3(conv(c, c)) {
    n1 = register_module("n1", std::make_shared<Spadain>(c, norm));
    n2 = register_module("n2", std::make_shared<Spadain>(c, norm));
    n3 = register_module("n3", std::make_shared<Spadain>(c, norm));
    register_module("c1", c1);
    register_module("c2", c2);
    register_module("c3", c3);
  }
  /// n1 and n3 normalise the same x, which is done once.
  Tensor forward(const Tensor& x, const Tensor& mesh) {
    const Tensor unit = n1->unit(x);
    const Tensor inner = map(c1, n1->forward(unit, mesh).relu_());
    const Tensor outer = map(c2, n2->forward(n2->unit(inner), mesh).relu_());
    return outer + map(c3, n3->forward(unit, mesh).relu_());
  }
  std::shared_ptr<Spadain> n1, n2, n3;
  nn::Conv1d c1, c2, c3;
};

struct CrossAttention : nn::Module {
  explicit CrossAttention(int64_t c)
      : q(register_module("q", conv(c, c))),
        k(register_module("k", conv(c, c))),
        v(register_module("v", conv(c, c))),
        gamma(register_parameter("gamma", torch::zeros({1}))) {}
  /// Of targets [n, c, v] over the codes [n * t, c, v] of t frames each, which are added.
  Tensor forward(const Tensor& target, const Tensor& x) {
    const int64_t t = x.size(0) / target.size(0);
    const Tensor queries = map(q, target).unsqueeze(1).expand({-1, t, -1, -1}).flatten(0, 1);
    return torch::addcmul(x, attend(queries, map(k, x), map(v, x)), gamma);
  }
  nn::Conv1d q, k, v;
  Tensor gamma;
};

struct Npt : Poser {
  explicit Npt(const Widths& w)
      : enc(register_module("enc", std::make_shared<PoseEncoder>(w))),
        out(register_module("out", conv((w[2] + 3) / 4, 3))) {
    const int64_t full = w[2] + 3;
    int64_t in = full;
    for (const int64_t c : {full, full / 2, full / 4}) {
      convs->push_back(conv(in, c));
      blocks->push_back(std::make_shared<SpadainBlock>(c, c != full));
      in = c;
    }
    register_module("convs", convs);
    register_module("blocks", blocks);
  }
  Tensor forward(const Tensor& pose, const Tensor& target) override {
    const Tensor code = std::get<0>(enc->forward(pose).max(2, true));
    Tensor x = torch::cat({code.expand({-1, -1, target.size(2)}), target}, 1);
    for (size_t i = 0; i < convs->size(); ++i)
      x = blocks->at<SpadainBlock>(i).forward(map(conv_of(convs, i), x), target);
    return points_of(out, x);
  }
  std::shared_ptr<PoseEncoder> enc;
  nn::ModuleList convs, blocks;
  nn::Conv1d out;
};

struct Lart : WindowPoser {
  explicit Lart(const Widths& w)
      : time(register_parameter("time", torch::zeros({3, w[2]}))),
        enc(register_module("enc", std::make_shared<PoseEncoder>(w))),
        out(register_module("out", conv(w[2] / 4, 3))) {
    const int64_t full = w[2];
    int64_t in = full;
    for (const int64_t c : {full, full / 2, full / 2, full / 4}) {
      convs->push_back(conv(in, c));
      att->push_back(std::make_shared<CrossAttention>(c));
      blocks->push_back(std::make_shared<SpadainBlock>(c, blocks->size() > 0));
      in = c;
    }
    register_module("convs", convs);
    register_module("att", att);
    register_module("blocks", blocks);
  }
  Tensor codes(const Tensor& pose) override {
    const Tensor pooled = std::get<0>(enc->forward(pose.flatten(0, 1)).max(2));
    return pooled.view({pose.size(0), pose.size(1), -1}) + time;
  }
  Tensor decode(const Tensor& codes, const Tensor& target) override {
    const int64_t t = codes.size(1), v = target.size(2);
    const Tensor mesh = target.unsqueeze(1).expand({-1, t, -1, -1}).flatten(0, 1);
    Tensor u = enc->forward(target), x = codes.flatten(0, 1).unsqueeze(2).expand({-1, -1, v});
    for (size_t i = 0; i < convs->size(); ++i) {
      u = map(conv_of(convs, i), u);
      x = att->at<CrossAttention>(i).forward(u, map(conv_of(convs, i), x));
      x = blocks->at<SpadainBlock>(i).forward(x, mesh);
    }
    return points_of(out, x);
  }
  Tensor time;
  std::shared_ptr<PoseEncoder> enc;
  nn::ModuleList convs, att, blocks;
  nn::Conv1d out;
};

}  // namespace

std::shared_ptr<Poser> npt(const Widths& widths) { return std::make_shared<Npt>(widths); }
std::shared_ptr<WindowPoser> lart(const Widths& widths) { return std::make_shared<Lart>(widths); }

}  // namespace bench
