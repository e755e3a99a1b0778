#include "train/optim/adam.h"

#include "autograd/kernels/update.h"

namespace restage {

Adam::Adam(const std::vector<NamedParameter>& parameters, const AdamConfig& config, Decay decay)
    : UpdateRule(parameters, {.tensors = 2, .steps = true}), config_(config), decay_(decay) {}

void Adam::step(const Gradients& gradients, double rate, double scale) {
  const bool apart = decay_ == Decay::of_weights;
  for (Slot& s : slots_) {
    Parameter& p = *s.of.parameter;
    const Tensor* g = gradients.find(p.id);
    if (g == nullptr) continue;
    ++s.steps;
    if (apart) decay_weights(p.value, rate, config_.weight_decay);
    launch(AdamArgs{*g, p.value, s.m, s.v, rate, config_.beta1, config_.beta2, config_.eps,
                    apart ? 0 : config_.weight_decay, scale, s.steps});
  }
}

}  // namespace restage
