#include "nn/layers/mlp.h"

namespace restage {

ReluChain::ReluChain(std::initializer_list<int64_t> widths, const Init& init) {
  step = 2;
  const std::vector<int64_t> w(widths);
  for (size_t i = 0; i + 1 < w.size(); ++i)
    emplace(w[i], w[i + 1], init.sub(std::to_string(2 * i)));
}

Var ReluChain::operator()(Context& ctx, const Var& x) const {
  const ModuleScope path(scope);
  Var y = x;
  for (size_t i = 0; i < size(); ++i)
    y = (*this)[i](ctx, y, i + 1 < size() ? Activation::relu : Activation::none);
  return y;
}

}  // namespace restage
