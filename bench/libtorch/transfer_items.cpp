// Training steps of the systems without a skeleton, by the names of ../transfers.h.
#include "training.h"
#include "transfers.h"

namespace bench {
namespace {

constexpr double kMixture = 0.3;  // of ../transfer_items.cpp

/// The faces of a batch of targets, each target for t frames: rows of all vertices below one
/// another, without the faces that only fill up. `shares`: 1 over the number of its target's.
struct Faces {
  Faces(const Tensor& faces, int64_t t, int64_t vertices) {
    std::vector<Tensor> rows, parts;
    for (int64_t i = 0; i < faces.size(0) * t; ++i) {
      const Tensor all = faces[i / t];
      const Tensor real = all.index({all.select(1, 0) != all.select(1, 1)});
      rows.push_back(real + i * vertices);
      parts.push_back(torch::full({real.size(0), 1}, 1.0 / static_cast<double>(real.size(0))));
    }
    corners = torch::cat(rows).flatten();
    shares = torch::cat(parts);
  }
  /// Lengths of the edges of meshes [n, 3, v]: [faces, 3].
  Tensor lengths(const Tensor& x) const {
    const Tensor rows = x.transpose(1, 2).reshape({-1, 3});
    const Tensor from = torch::embedding(rows, corners).view({-1, 3, 3});
    return (from - torch::cat({from.slice(1, 1), from.slice(1, 0, 1)}, 1)).norm(2, -1);
  }
  Tensor corners, shares;
};

/// Mean over the meshes of NPT's edge loss.
Tensor edge_loss(const Faces& faces, const Tensor& made, const Tensor& right) {
  const Tensor ratios = faces.lengths(made) / faces.lengths(right);
  return ((ratios - 1).abs_() * faces.shares).sum() / made.size(0);
}

Tensor distances(const Tensor& x, int64_t points) {
  const Tensor some = x.slice(2, 0, points).transpose(1, 2).contiguous();
  return torch::cdist(some, some, 2, 2);  // by differences, not by products
}

/// One batch with channels before points: pose and truth [n, t, 3, v], target [n, 3, v].
struct Pairs {
  Pairs(const Inputs& in, const std::string& name)
      : pose(in.at(name + ".pose").transpose(2, 3).contiguous()),
        target(in.at(name + ".identity").transpose(1, 2).contiguous()),
        truth(in.at(name + ".truth").transpose(2, 3).contiguous()),
        faces(in.at(name + ".faces"), truth.size(1), truth.size(3)) {}
  Tensor pose, target, truth;
  Faces faces;
};

/// NPT and 3D-CoreNet.
std::unique_ptr<Item> by_frame(const Inputs& in, const std::string& name,
                               const std::shared_ptr<Poser>& net, int64_t parameters,
                               double reconstruction, double edge,
                               const torch::optim::AdamOptions& options = {}) {
  in.load(*net, name, parameters);
  const Pairs p(in, name);
  const Tensor pose = p.pose.flatten(0, 1), truth = p.truth.flatten(0, 1);
  return std::make_unique<Training>(
      net->parameters(),
      [=] {
        const Tensor made = net->forward(pose, p.target);
        return reconstruction * torch::mse_loss(made, truth) +
               edge * edge_loss(p.faces, made, p.target);
      },
      options);
}

std::unique_ptr<Item> corenet_training(const Inputs& in, const std::string& name,
                                       const Widths& widths, const Widths& generator,
                                       int64_t parameters) {
  return by_frame(in, name, corenet(widths, generator), parameters, 1000, 0.5,
                  torch::optim::AdamOptions().betas({0, 0.9}).eps(1e-3));
}

/// In its second phase: with the metric loss.
std::unique_ptr<Item> lart_training(const Inputs& in, const std::string& name, const Widths& widths,
                                    int64_t parameters, int64_t points) {
  const auto net = lart(widths);
  in.load(*net, name, parameters);
  const Pairs p(in, name);
  const Tensor truth = p.truth.flatten(0, 1), first = p.truth.select(1, 0),
               last = p.truth.select(1, -1);
  return std::make_unique<Training>(net->parameters(), [=] {
    const Tensor codes = net->codes(p.pose), made = net->decode(codes, p.target);
    const Tensor mixture = codes.slice(1, 0, 1) * (1 - kMixture) + codes.slice(1, -1) * kMixture;
    const Tensor mixed = distances(net->decode(mixture, p.target), points);
    const Tensor wanted =
        distances(first, points) * (1 - kMixture) + distances(last, points) * kMixture;
    return torch::mse_loss(made, truth) + 0.0005 * edge_loss(p.faces, made, truth) +
           0.1 * torch::mse_loss(mixed, wanted);
  });
}

}  // namespace

std::unique_ptr<Item> make_transfer_item(const std::string& name, const Inputs& in) {
  const Widths small{32, 64, 256}, large{64, 128, 1024};
  if (name == "npt_lite_train") return by_frame(in, name, npt({32, 64, 253}), 0, 1, 0.0005);
  if (name == "npt_paper_train") return by_frame(in, name, npt(large), 6054941, 1, 0.0005);
  if (name == "lart_lite_train") return lart_training(in, name, small, 0, 512);
  if (name == "lart_paper_train") return lart_training(in, name, large, 12012423, 1024);
  if (name == "corenet_lite_train")
    return corenet_training(in, name, {32, 64, 128}, {256, 128, 64}, 0);
  if (name == "corenet_paper_train")
    return corenet_training(in, name, {64, 128, 256}, {1024, 512, 256}, 24461447);
  return nullptr;
}

}  // namespace bench
