#include "train/optim/adam.h"

#include "autograd/kernels/update.h"

namespace restage {

Adam::Adam(const std::vector<NamedParameter>& parameters, const AdamConfig& config, Decay decay)
    : UpdateRule(parameters, {.tensors = 2, .steps = true}), config_(config), decay_(decay) {}

void Adam::step(const Gradients& gradients, double rate, double scale) {
  const bool apart = decay_ == Decay::of_weights;
  std::vector<AdamArgs::Of> moving;
  for (Slot& s : slots_)
    if (const Tensor* g = gradients.find(s.of.parameter->id))
      moving.push_back({*g, s.of.parameter->value, s.m, s.v, ++s.steps});
  launch_all(AdamArgs{moving, rate, config_.beta1, config_.beta2, config_.eps,
                      apart ? 0 : config_.weight_decay, scale,
                      apart ? 1 - rate * config_.weight_decay : 1});
}

}  // namespace restage
