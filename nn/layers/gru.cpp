#include "nn/layers/gru.h"

#include <cmath>

#include "autograd/ops/layout.h"
#include "autograd/ops/rnn.h"
#include "nn/layers/linear.h"

namespace restage {

GruLayer::GruLayer(int64_t in, int64_t hidden, int layers, double dropout, const Init& init)
    : hidden_(hidden), dropout_(dropout) {
  const double bound = 1.0 / std::sqrt(static_cast<double>(hidden));
  for (int l = 0; l < layers; ++l) {
    auto w = std::make_unique<Weights>();
    const std::string suffix = "_l" + std::to_string(l);
    w->w_ih.value = init.uniform({3 * hidden, l == 0 ? in : hidden}, bound, "weight_ih" + suffix);
    w->w_hh.value = init.uniform({3 * hidden, hidden}, bound, "weight_hh" + suffix);
    w->b_ih.value = init.uniform({3 * hidden}, bound, "bias_ih" + suffix);
    w->b_hh.value = init.uniform({3 * hidden}, bound, "bias_hh" + suffix);
    layers_.push_back(std::move(w));
  }
}

Var GruLayer::operator()(Context& ctx, const Var& x, Var* state) const {
  const ModuleScope path(scope);
  const int64_t n = x.size(0), t = x.size(1);
  Var y = permute(x, {1, 0, 2});
  InlineVector<Var, kMaxInputs> last;
  for (size_t l = 0; l < layers_.size(); ++l) {
    const Weights& w = *layers_[l];
    const auto index = static_cast<int64_t>(l);
    const Var h0 = state->value.defined()
                       ? reshape(slice(*state, 0, index, index + 1), {n, hidden_})
                       : Var(Tensor::zeros({n, hidden_}, x.dtype(), x.value.device()));
    if (l > 0) y = dropout(ctx, y, dropout_);
    y = gru(y, h0, ctx.bind(w.w_ih), ctx.bind(w.w_hh), ctx.bind(w.b_ih), ctx.bind(w.b_hh));
    last.push_back(t > 0 ? slice(y, 0, t - 1, t) : reshape(h0, {1, n, hidden_}));
  }
  *state = call(Concat{0}, std::span<const Var>(last.data(), last.size()));
  return permute(y, {1, 0, 2});
}

void GruLayer::visit(Fields& f) {
  for (size_t l = 0; l < layers_.size(); ++l) {
    const std::string suffix = "_l" + std::to_string(l);
    f("weight_ih" + suffix, layers_[l]->w_ih);
    f("weight_hh" + suffix, layers_[l]->w_hh);
    f("bias_ih" + suffix, layers_[l]->b_ih);
    f("bias_hh" + suffix, layers_[l]->b_hh);
  }
}

}  // namespace restage
