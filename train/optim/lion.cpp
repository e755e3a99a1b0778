#include "train/optim/lion.h"

#include "autograd/kernels/elementwise.h"
#include "autograd/kernels/update.h"

namespace restage {
namespace {

/// -1, 0 or 1 for each number: the derivative of its absolute value.
Tensor signs_of(const Tensor& x) {
  const Tensor nothing = times(x, 0);
  Tensor ones = empty_like(x), out = empty_like(x);
  launch(UnaryArgs{Unary::add_scalar, nothing, ones, 1});
  launch(UnaryGradArgs{Unary::abs, &x, ones, out});
  return out;
}

}  // namespace

Lion::Lion(const std::vector<NamedParameter>& parameters, const LionConfig& config)
    : UpdateRule(parameters, {.tensors = 1}), config_(config) {}

void Lion::step(const Gradients& gradients, double rate, double scale) {
  for (Slot& s : slots_) {
    Tensor& p = s.of.parameter->value;
    const Tensor* g = gradients.find(s.of.parameter->id);
    if (g == nullptr) continue;
    Tensor direction = times(s.m, config_.beta1);
    mix(*g, direction, 1, (1 - config_.beta1) * scale);
    decay_weights(p, rate, config_.weight_decay);
    mix(signs_of(direction), p, 1, -rate);
    mix(*g, s.m, config_.beta2, (1 - config_.beta2) * scale);
  }
}

}  // namespace restage
