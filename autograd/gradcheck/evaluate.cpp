#include "autograd/gradcheck/evaluate.h"

#include <cstring>

#include "autograd/ops/reduce.h"

namespace restage::gradcheck {

Var built(const Sample& s, const std::vector<Tensor>& inputs) {
  std::vector<Var> x;
  for (const Tensor& t : inputs) x.emplace_back(t.to(s.device));
  return s.build(x);
}

Tensor value_of(const Sample& s, const std::vector<Tensor>& inputs) {
  return built(s, inputs).value.cpu();
}

Evaluation evaluate(const Sample& s, const Tensor& u, const std::function<bool(size_t)>& on_tape) {
  Tape tape;
  std::vector<Var> x;
  for (size_t k = 0; k < s.inputs.size(); ++k) {
    const Tensor t = s.inputs[k].to(s.device);
    x.push_back(!on_tape || on_tape(k) ? tape.leaf(t, k + 1) : Var(t));
  }
  const Var y = s.build(x);
  Evaluation e{y.value.cpu(), std::vector<Tensor>(s.inputs.size())};
  Gradients g;
  if (y.on_tape()) g = tape.backward(sum_all(mul(y, Var(u.to(s.device)))));
  for (size_t k = 0; k < s.inputs.size(); ++k) {
    if (const Tensor* found = g.find(k + 1)) {
      e.gradients[k] = found->cpu();
    } else if (x[k].on_tape()) {
      e.gradients[k] = Tensor::zeros(s.inputs[k].shape(), s.inputs[k].dtype());
    }
  }
  return e;
}

bool same_bits(const Tensor& a, const Tensor& b) {
  if (a.defined() != b.defined()) return false;
  if (!a.defined()) return true;
  const size_t bytes = static_cast<size_t>(a.numel()) * size_of(a.dtype());
  return a.shape() == b.shape() && a.dtype() == b.dtype() &&
         (bytes == 0 || std::memcmp(a.bytes(), b.bytes(), bytes) == 0);
}

bool same_bits(const Evaluation& a, const Evaluation& b) {
  if (!same_bits(a.value, b.value)) return false;
  for (size_t k = 0; k < a.gradients.size(); ++k)
    if (!same_bits(a.gradients[k], b.gradients[k])) return false;
  return true;
}

}  // namespace restage::gradcheck
