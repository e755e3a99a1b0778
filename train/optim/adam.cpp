#include "train/optim/adam.h"

#include "autograd/kernels/update.h"

namespace restage {

Adam::Adam(const std::vector<NamedParameter>& parameters, const AdamConfig& config)
    : config_(config) {
  for (const NamedParameter& p : parameters) {
    const auto zeros = [&] {
      const Tensor& t = p.parameter->value;
      return Tensor::zeros(t.shape(), t.dtype(), t.device());
    };
    slots_.push_back({p, zeros(), zeros(), 0});
  }
}

void Adam::step(const Gradients& gradients, double rate, double scale) {
  for (Slot& s : slots_) {
    Parameter& p = *s.of.parameter;
    const Tensor* g = gradients.find(p.id);
    if (g == nullptr) continue;
    ++s.steps;
    launch(AdamArgs{*g, p.value, s.m, s.v, rate, config_.beta1, config_.beta2, config_.eps,
                    config_.weight_decay, scale, s.steps});
  }
}

void Adam::save(const std::string& prefix, TensorFile& file) const {
  for (const Slot& s : slots_) {
    const std::string name = prefix + s.of.name;
    file.tensors[name + ".m"] = s.m.cpu();
    file.tensors[name + ".v"] = s.v.cpu();
    file.tensors[name + ".steps"] = Tensor::from<int64_t>({1}, {s.steps});
  }
}

void Adam::load(const std::string& prefix, const TensorFile& file, const std::string& where) {
  for (Slot& s : slots_) {
    const std::string name = prefix + s.of.name;
    const Shape& shape = s.of.parameter->value.shape();
    s.m = saved_state(file, name + ".m", shape, where, s.m.device());
    s.v = saved_state(file, name + ".v", shape, where, s.v.device());
    s.steps = saved_state(file, name + ".steps", {1}, where).data<int64_t>()[0];
  }
}

}  // namespace restage
