// What all items that train have in common.
#pragma once

#include <torch/torch.h>

#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "items.h"

namespace bench {

/// The same batch in every step: forward and backward.
class Gradients : public Item {
 public:
  Gradients(std::vector<Tensor> parameters, std::function<Tensor()> loss)
      : parameters_(std::move(parameters)), loss_(std::move(loss)) {}
  void run() override {
    for (Tensor& p : parameters_) p.mutable_grad().reset();
    loss_().backward();
  }
  std::vector<double> check() override {
    const Tensor loss = loss_();
    loss.backward();
    double square = 0;
    for (const Tensor& p : parameters_)
      if (p.grad().defined()) square += p.grad().to(torch::kDouble).square().sum().item<double>();
    return {loss.item<double>(), std::sqrt(square)};
  }

 protected:
  std::vector<Tensor> parameters_;
  std::function<Tensor()> loss_;
};

/// And Adam.
class Training : public Gradients {
 public:
  Training(std::vector<Tensor> parameters, std::function<Tensor()> loss,
           torch::optim::AdamOptions options = {})
      : Gradients(std::move(parameters), std::move(loss)), adam_(parameters_, options.lr(kRate)) {}
  void run() override {
    adam_.zero_grad();
    loss_().backward();
    adam_.step();
  }

 private:
  static constexpr double kRate = 1e-5;

  torch::optim::Adam adam_;
};

}  // namespace bench
