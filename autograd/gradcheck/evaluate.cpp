#include "autograd/gradcheck/evaluate.h"

#include <cstring>

#include "autograd/ops/reduce.h"

namespace restage::gradcheck {

Tensor value_of(const Sample& s, const std::vector<Tensor>& inputs) {
  return s.build({inputs.begin(), inputs.end()}).value;
}

Evaluation evaluate(const Sample& s, const Tensor& u, const std::function<bool(size_t)>& on_tape) {
  Tape tape;
  std::vector<Var> x;
  for (size_t k = 0; k < s.inputs.size(); ++k)
    x.push_back(!on_tape || on_tape(k) ? tape.leaf(s.inputs[k], k + 1) : Var(s.inputs[k]));
  const Var y = s.build(x);
  Evaluation e{y.value, std::vector<Tensor>(s.inputs.size())};
  Gradients g;
  if (y.tape != nullptr) g = tape.backward(sum_all(mul(y, Var(u))));
  for (size_t k = 0; k < s.inputs.size(); ++k) {
    if (const Tensor* found = g.find(k + 1)) {
      e.gradients[k] = *found;
    } else if (x[k].tape != nullptr) {
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
         (bytes == 0 || std::memcmp(a.raw(), b.raw(), bytes) == 0);
}

bool same_bits(const Evaluation& a, const Evaluation& b) {
  if (!same_bits(a.value, b.value)) return false;
  for (size_t k = 0; k < a.gradients.size(); ++k)
    if (!same_bits(a.gradients[k], b.gradients[k])) return false;
  return true;
}

}  // namespace restage::gradcheck
