#include "bench/transfers.h"

#include "nn/models/lart.h"
#include "nn/models/registry.h"

namespace restage::bench {

const std::vector<TransferCase>& transfer_cases() {
  static const std::vector<TransferCase> all = {
      {"npt_lite_train", "transfer/npt_pool", {"widths=[32, 64, 253]"}, 8, 1000},
      {"npt_paper_train", "transfer/npt_pool", {}, 1, 2048},
      {"lart_lite_train", "transfer/lart", {"widths=[32, 64, 256]"}, 2, 1000, 512},
      {"lart_paper_train", "transfer/lart", {}, 1, 2048, 1024},
      {"corenet_lite_train",
       "transfer/corenet",
       {"widths=[32, 64, 128]", "generator=[256, 128, 64]"},
       4,
       1000},
      {"corenet_paper_train", "transfer/corenet", {}, 1, 2048}};
  return all;
}

std::shared_ptr<TransferModel> transfer_model(const TransferCase& c) {
  const Init init{RngKey{0, 0}.fold(c.name), DType::f32};
  auto net = make_model_as<TransferModel>(c.model, model_config(c.model, c.sizes), init);
  if (auto* lart = dynamic_cast<Lart*>(net.get()))
    for (size_t i = 0; i < lart->att.size(); ++i) lart->att[i].gamma.value = Tensor::full({1}, 0.1);
  return net;
}

TransferBatch transfer_batch(const Corpus& corpus, const TransferCase& c, int64_t frames) {
  TransferConfig config;
  config.frames = static_cast<int>(frames);
  config.points = config.vertices = static_cast<int>(c.vertices);
  return TransferSampler(corpus, config, 0).batch(0, c.batch);
}

}  // namespace restage::bench
