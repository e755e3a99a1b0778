#include "train/optim/adam.h"

#include <algorithm>

#include "autograd/kernels/update.h"

namespace restage {

Adam::Adam(const std::vector<std::pair<std::string, Module*>>& modules, const AdamConfig& config)
    : config_(config) {
  for (const auto& [prefix, module] : modules) {
    for (const StateEntry& e : state_of(*module, prefix)) {
      if (e.parameter == nullptr) continue;
      Slot slot{e.name,
                e.parameter,
                Tensor::zeros(e.value->shape(), e.value->dtype()),
                Tensor::zeros(e.value->shape(), e.value->dtype()),
                Tensor(),
                0};
      if (config.amsgrad) slot.v_max = Tensor::zeros(e.value->shape(), e.value->dtype());
      slots_.push_back(std::move(slot));
      ids_.push_back(e.parameter->id);
    }
  }
  std::sort(ids_.begin(), ids_.end());
}

void Adam::step(const Gradients& gradients, double rate, double clip) {
  double scale = 1;
  if (clip > 0) scale = std::min(1.0, clip / (gradients.norm(ids_) + 1e-6));
  for (Slot& s : slots_) {
    const Tensor* g = gradients.find(s.parameter->id);
    if (g == nullptr) continue;
    ++s.steps;
    launch(AdamArgs{*g, s.parameter->value, s.m, s.v, config_.amsgrad ? &s.v_max : nullptr, rate,
                    config_.beta1, config_.beta2, config_.eps, config_.weight_decay, scale,
                    s.steps});
  }
}

void Adam::save(const std::string& prefix, TensorFile& file) const {
  for (const Slot& s : slots_) {
    file.tensors[prefix + s.name + ".m"] = s.m;
    file.tensors[prefix + s.name + ".v"] = s.v;
    if (config_.amsgrad) file.tensors[prefix + s.name + ".v_max"] = s.v_max;
    file.tensors[prefix + s.name + ".steps"] = Tensor::from<int64_t>({1}, {s.steps});
  }
}

void Adam::load(const std::string& prefix, const TensorFile& file, const std::string& where) {
  const auto take = [&](const std::string& name, const Shape& shape) {
    const Tensor* t = file.find(name);
    if (t == nullptr || !(t->shape() == shape))
      throw InputError(where, "optimiser state '" + name + "' is missing or of another size",
                       "resume with the configuration that the run was made with");
    return t->clone();
  };
  for (Slot& s : slots_) {
    const Shape& shape = s.parameter->value.shape();
    s.m = take(prefix + s.name + ".m", shape);
    s.v = take(prefix + s.name + ".v", shape);
    if (config_.amsgrad) s.v_max = take(prefix + s.name + ".v_max", shape);
    s.steps = take(prefix + s.name + ".steps", {1}).data<int64_t>()[0];
  }
}

}  // namespace restage
