// Full training steps of the systems that pose a mesh without a skeleton (transfers.h).
#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"
#include "bench/training.h"
#include "bench/transfer_work.h"
#include "bench/transfers.h"
#include "nn/losses/transfer.h"

namespace restage::bench {
namespace {

constexpr double kMixture = 0.3;  // how much of the last frame is in the code of the metric loss

/// Weights of the losses, as in the configurations.
struct Losses {
  double reconstruction = 1, edge = 0.0005, metric = 0.1;
};

/// The loss of train/stages/transfer_stage.cpp.
class TransferTraining : public Training {
 public:
  TransferTraining(const Inputs& inputs, const std::string& variant, const TransferCase& c)
      : metric_points_(c.metric_points), net_(transfer_model(c)) {
    inputs.load(*net_, variant, c.name);
    const auto of = [&](const char* part) { return inputs.at(c.name + "." + part); };
    pairs_ = {of("pose"), of("identity"), of("truth"), of("faces")};
    OptimiserConfig optimiser;
    if (c.model == "transfer/corenet") {
      losses_ = {1000, 0.5, 0};
      optimiser.adam = {0, 0.9, 0, 1e-3};
    }
    train(
        {{"", net_.get()}}, [this](Context& ctx) { return loss(ctx); }, optimiser);
  }

 private:
  Var loss(Context& ctx) {
    const int64_t n = pairs_.truth.size(0), t = pairs_.truth.size(1), v = pairs_.truth.size(2);
    const Var made = net_->forward(ctx, {pairs_.pose, pairs_.identity});
    // LART's edges have the right lengths in the true answer, those of the others in the target.
    const Tensor right = metric_points_ > 0 ? pairs_.truth : pairs_.identity;
    const Var edges =
        edge_loss(reshape(made, {n * t, v, 3}), right.reshape({n * t, v, 3}), pairs_.faces);
    Var total = scale(mse(made, pairs_.truth), losses_.reconstruction) +
                scale(mean_all(edges), losses_.edge);
    if (metric_points_ > 0) total = total + scale(metric(ctx), losses_.metric);
    return total;
  }

  Var metric(Context& ctx) {
    auto& lart = dynamic_cast<Lart&>(*net_);
    const int64_t n = pairs_.truth.size(0), last = pairs_.truth.size(1) - 1;
    const Var codes = lart.codes(ctx, pairs_.pose);
    const auto code = [&](int64_t t) { return slice(codes, 1, t, t + 1); };
    const auto truth = [&](int64_t t) {
      const Var frame = slice(pairs_.truth, 1, t, t + 1);
      return slice(reshape(frame, {n, frame.size(2), 3}), 1, 0, metric_points_).value;
    };
    const Var mixed =
        lart.decode(ctx, code(0) * (1 - kMixture) + code(last) * kMixture, pairs_.identity);
    const Var mesh = reshape(mixed, {n, mixed.size(2), 3});
    return metric_loss(slice(mesh, 1, 0, metric_points_), truth(0), truth(last), kMixture);
  }

  int64_t metric_points_;
  Losses losses_;
  std::shared_ptr<TransferModel> net_;
  TransferBatch pairs_;
};

template <size_t number>
std::unique_ptr<Item> training(const Inputs& inputs, const std::string& variant, bool) {
  return std::make_unique<TransferTraining>(inputs, variant, transfer_cases()[number]);
}

double forward_gflop(const TransferCase& c) {
  const AnyConfig config = model_config(c.model, c.sizes);
  if (c.model == "transfer/npt_pool") return npt_gflop(config.as<NptConfig>(), c.vertices);
  if (c.model == "transfer/lart") return lart_gflop(config.as<LartConfig>(), c.vertices);
  return corenet_gflop(config.as<CoreNetConfig>(), c.vertices);
}

template <size_t number>
ItemInfo info(const char* what, const char* per) {
  const TransferCase& c = transfer_cases()[number];
  return ItemInfo(c.name, what, per, static_cast<int>(c.batch), 3 * forward_gflop(c),
                  training<number>);
}

}  // namespace

std::vector<ItemInfo> transfer_items() {
  return {info<0>("NPT, lite, batch 8 of 1,000 vertices", "pair"),
          info<1>("NPT, 2,048 vertices", "pair"),
          info<2>("LART, lite, 2 windows of 3 frames, 1,000 vertices", "window"),
          info<3>("LART, a window of 3 frames, 2,048 vertices", "window"),
          info<4>("3D-CoreNet, lite, batch 4 of 1,000 vertices", "pair"),
          info<5>("3D-CoreNet, 2,048 vertices", "pair")};
}

}  // namespace restage::bench
