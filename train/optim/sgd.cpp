#include "train/optim/sgd.h"

#include "autograd/kernels/update.h"

namespace restage {

Sgd::Sgd(const std::vector<NamedParameter>& parameters, const SgdConfig& config)
    : UpdateRule(parameters,
                 {.tensors = config.momentum > 0 ? 1 : 0, .steps = config.momentum > 0}),
      config_(config) {}

void Sgd::step(const Gradients& gradients, double rate, double scale) {
  for (Slot& s : slots_) {
    Tensor& p = s.of.parameter->value;
    const Tensor* found = gradients.find(s.of.parameter->id);
    if (found == nullptr) continue;
    Tensor g = times(*found, scale);
    if (config_.weight_decay > 0) mix(p, g, 1, config_.weight_decay);
    if (config_.momentum > 0) {
      const bool first = s.steps++ == 0;  // PyTorch's buffer begins with the first gradient
      mix(g, s.m, first ? 0 : config_.momentum, 1);
      if (config_.nesterov) mix(s.m, g, 1, config_.momentum);
    }
    const bool by_sum = config_.momentum > 0 && !config_.nesterov;
    mix(by_sum ? s.m : g, p, 1, -rate);
  }
}

}  // namespace restage
