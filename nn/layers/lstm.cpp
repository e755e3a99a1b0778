#include "nn/layers/lstm.h"

#include <cmath>
#include <string>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/linear.h"

namespace restage {

LstmLayer::LstmLayer(int64_t in, int64_t hidden, int layers, const Init& init) : hidden_(hidden) {
  const double bound = 1.0 / std::sqrt(static_cast<double>(hidden));
  for (int l = 0; l < layers; ++l) {
    auto w = std::make_unique<Weights>();
    const std::string suffix = "_l" + std::to_string(l);
    w->w_ih.value = init.uniform({4 * hidden, l == 0 ? in : hidden}, bound, "weight_ih" + suffix);
    w->w_hh.value = init.uniform({4 * hidden, hidden}, bound, "weight_hh" + suffix);
    w->b_ih.value = init.uniform({4 * hidden}, bound, "bias_ih" + suffix);
    w->b_hh.value = init.uniform({4 * hidden}, bound, "bias_hh" + suffix);
    layers_.push_back(std::move(w));
  }
}

Var LstmLayer::operator()(Context& ctx, const Var& x, Var* hidden, Var* cell) const {
  const ModuleScope path(scope);
  const int64_t n = x.size(0), t = x.size(1);
  const Var zero(Tensor::zeros({n, hidden_}, x.dtype(), x.value.device()));
  std::vector<Var> last_h, last_c;
  Var in = x;
  for (const auto& w : layers_) {
    const Var all = linear(in, ctx.bind(w->w_ih), ctx.bind(w->b_ih));  // of every step at once
    Var h = zero, c = zero;
    std::vector<Var> steps;
    for (int64_t s = 0; s < t; ++s) {
      const Var gates = reshape(slice(all, 1, s, s + 1), {n, 4 * hidden_}) +
                        linear(h, ctx.bind(w->w_hh), ctx.bind(w->b_hh));
      const Vars gate = split(gates, 1, {hidden_, hidden_, hidden_, hidden_});
      c = sigmoid(gate[1]) * c + sigmoid(gate[0]) * tanh(gate[2]);
      h = sigmoid(gate[3]) * tanh(c);
      steps.push_back(reshape(h, {n, 1, hidden_}));
    }
    in = concat(std::span<const Var>(steps), 1);
    last_h.push_back(reshape(h, {1, n, hidden_}));
    last_c.push_back(reshape(c, {1, n, hidden_}));
  }
  if (hidden != nullptr) *hidden = concat(std::span<const Var>(last_h), 0);
  if (cell != nullptr) *cell = concat(std::span<const Var>(last_c), 0);
  return in;
}

void LstmLayer::visit(Fields& f) {
  for (size_t l = 0; l < layers_.size(); ++l) {
    const std::string suffix = "_l" + std::to_string(l);
    f("weight_ih" + suffix, layers_[l]->w_ih);
    f("weight_hh" + suffix, layers_[l]->w_hh);
    f("bias_ih" + suffix, layers_[l]->b_ih);
    f("bias_hh" + suffix, layers_[l]->b_hh);
  }
}

}  // namespace restage
