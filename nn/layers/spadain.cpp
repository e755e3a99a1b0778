#include "nn/layers/spadain.h"

#include <string>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/norm.h"

namespace restage {

PoseEncoder::PoseEncoder(const std::array<int64_t, 3>& widths, const Init& init) {
  int64_t in = 3;
  for (size_t i = 0; i < widths.size(); ++i) {
    convs.emplace(in, widths[i], init.sub("convs." + std::to_string(i)), true, 1);
    in = widths[i];
  }
}

Var PoseEncoder::operator()(Context& ctx, const Var& points) const {
  const ModuleScope path(scope);
  Var x = points;
  for (size_t i = 0; i < convs.size(); ++i) x = relu(instance_norm(convs[i](ctx, x)));
  return x;
}

Spadain::Spadain(int64_t channels, bool norm, const Init& init)
    : scale(3, channels, init.sub("scale"), true, 1),
      shift(3, channels, init.sub("shift"), true, 1),
      norm_(norm) {}

Var Spadain::operator()(Context& ctx, const Var& x, const Var& mesh) const {
  const ModuleScope path(scope);
  return scale(ctx, mesh) * (norm_ ? instance_norm(x) : x) + shift(ctx, mesh);
}

void Spadain::visit(Fields& f) {
  f("scale", scale);
  f("shift", shift);
}

SpadainBlock::SpadainBlock(int64_t channels, bool norm, const Init& init)
    : n1(channels, norm, init.sub("n1")),
      n2(channels, norm, init.sub("n2")),
      n3(channels, norm, init.sub("n3")),
      c1(channels, channels, init.sub("c1"), true, 1),
      c2(channels, channels, init.sub("c2"), true, 1),
      c3(channels, channels, init.sub("c3"), true, 1) {}

Var SpadainBlock::operator()(Context& ctx, const Var& x, const Var& mesh) const {
  const ModuleScope path(scope);
  const Var inner = c1(ctx, relu(n1(ctx, x, mesh)));
  const Var outer = c2(ctx, relu(n2(ctx, inner, mesh)));
  return outer + c3(ctx, relu(n3(ctx, x, mesh)));
}

void SpadainBlock::visit(Fields& f) {
  f("n1", n1);
  f("n2", n2);
  f("n3", n3);
  f("c1", c1);
  f("c2", c2);
  f("c3", c3);
}

}  // namespace restage
