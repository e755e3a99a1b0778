// What all items that train have in common.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bench/items.h"
#include "train/optim/optimiser.h"
#include "train/stage.h"

namespace restage::bench {

/// A model, a loss and an optimiser; the same batch in every step.
class Training : public Item {
 public:
  using Loss = std::function<Var(Context&)>;

  void run() override { adam_->step(differentiate(key_.fold(step_++), loss_).gradients, kRate); }
  std::vector<double> check() override {
    const Differentiated d = differentiate(key_, loss_);
    return {d.loss, d.norm};
  }

 protected:
  void train(const std::vector<std::pair<std::string, Module*>>& modules, Loss loss,
             const OptimiserConfig& config = {}) {
    adam_ = std::make_unique<Optimiser>(modules, config);
    loss_ = std::move(loss);
  }

 private:
  static constexpr double kRate = 1e-5;  // small, so that weights stay what the variant says

  std::unique_ptr<Optimiser> adam_;
  Loss loss_;
  RngKey key_ = RngKey{0, 0}.fold("bench");
  uint64_t step_ = 0;
};

}  // namespace restage::bench
