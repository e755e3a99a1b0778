#include "train/optim/update_rule.h"

#include "autograd/kernels/elementwise.h"
#include "autograd/kernels/update.h"

namespace restage {

UpdateRule::UpdateRule(const std::vector<NamedParameter>& parameters, const Keeps& keeps)
    : keeps_(keeps) {
  for (const NamedParameter& p : parameters) {
    const Tensor& t = p.parameter->value;
    Slot& slot = slots_.emplace_back(Slot{p});
    if (keeps.tensors > 0) slot.m = Tensor::zeros(t.shape(), t.dtype(), t.device());
    if (keeps.tensors > 1) slot.v = Tensor::zeros(t.shape(), t.dtype(), t.device());
  }
}

void UpdateRule::save(const std::string& prefix, TensorFile& file) const {
  for (const Slot& s : slots_) {
    const std::string name = prefix + s.of.name;
    if (keeps_.tensors > 0) file.tensors[name + ".m"] = s.m.cpu();
    if (keeps_.tensors > 1) file.tensors[name + ".v"] = s.v.cpu();
    if (keeps_.steps) file.tensors[name + ".steps"] = Tensor::from<int64_t>({1}, {s.steps});
  }
}

void UpdateRule::load(const std::string& prefix, const TensorFile& file, const std::string& where) {
  for (Slot& s : slots_) {
    const std::string name = prefix + s.of.name;
    const auto read = [&](const char* what, Tensor& of) {
      of = saved_state(file, name + what, of.shape(), where, of.device());
    };
    if (keeps_.tensors > 0) read(".m", s.m);
    if (keeps_.tensors > 1) read(".v", s.v);
    if (keeps_.steps) s.steps = saved_state(file, name + ".steps", {1}, where).data<int64_t>()[0];
  }
}

Gradients clipped(const Gradients& gradients, std::span<const uint64_t> ids, double most) {
  Gradients out;
  for (const uint64_t id : ids) {
    const Tensor* g = gradients.find(id);
    if (g == nullptr) continue;
    const Tensor high = Tensor::full({}, most, g->dtype(), g->device());
    const Tensor low = Tensor::full({}, -most, g->dtype(), g->device());
    Tensor below = empty_like(*g), both = empty_like(*g);
    launch(BinaryArgs{Binary::minimum, *g, high, below});
    launch(BinaryArgs{Binary::maximum, below, low, both});
    out.set(id, both);
  }
  return out;
}

Tensor times(const Tensor& x, double factor) {
  Tensor out = empty_like(x);
  launch(UnaryArgs{Unary::scale, x, out, factor});
  return out;
}

void decay_weights(Tensor& p, double rate, double decay) {
  if (decay == 0) return;
  const Tensor before = p;  // the same numbers: each is read before it is written
  mix(before, p, 1 - rate * decay, 0);
}

}  // namespace restage
