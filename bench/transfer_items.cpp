// Full training steps of the systems that pose a mesh without a skeleton (transfers.h).
#include "bench/training.h"
#include "bench/transfer_work.h"
#include "bench/transfers.h"
#include "nn/losses/transfer.h"

namespace restage::bench {
namespace {

/// The loss of the stage `transfer`, with weights as in the configurations.
class TransferTraining : public Training {
 public:
  TransferTraining(const Inputs& inputs, const std::string& variant, const TransferCase& c)
      : net_(transfer_model(c)) {
    inputs.load(*net_, variant, c.name);
    const auto of = [&](const char* part) { return inputs.at(c.name + "." + part); };
    pairs_ = {of("pose"), of("identity"), of("truth"), of("faces")};
    OptimiserConfig optimiser;
    if (c.model == "transfer/corenet") {
      weights_.reconstruction = 1000;
      weights_.edge = 0.5;
      optimiser.adam = {0, 0.9, 0, 1e-3};
    }
    if (c.metric_points > 0) {  // LART, in its second phase
      weights_.edge_reference = EdgeReference::truth;
      weights_.metric = 0.1;
      weights_.metric_points = c.metric_points;
      weights_.mixture = 0.3;
    }
    train(
        {{"", net_.get()}},
        [this](Context& ctx) {
          Tensor made;
          return transfer_loss(ctx, *net_, pairs_, weights_, nullptr, &made);
        },
        optimiser);
  }

 private:
  std::shared_ptr<TransferModel> net_;
  TransferExamples pairs_;
  TransferWeights weights_;
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
