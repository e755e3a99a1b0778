#include "nn/layers/spadain.h"

#include <string>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/modulate.h"
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

Spadain::Spadain(int64_t channels, const Init& init)
    : scale(3, channels, init.sub("scale"), true, 1),
      shift(3, channels, init.sub("shift"), true, 1) {}

Var Spadain::operator()(Context& ctx, const Var& x, const Var& mesh, Activation activation) const {
  const ModuleScope path(scope);
  return modulate(x, mesh, scale.matrix(ctx), ctx.bind(scale.bias), shift.matrix(ctx),
                  ctx.bind(shift.bias), activation);
}

void Spadain::visit(Fields& f) {
  f("scale", scale);
  f("shift", shift);
}

SpadainBlock::SpadainBlock(int64_t channels, bool norm, const Init& init)
    : n1(channels, init.sub("n1")),
      n2(channels, init.sub("n2")),
      n3(channels, init.sub("n3")),
      c1(channels, channels, init.sub("c1"), true, 1),
      c2(channels, channels, init.sub("c2"), true, 1),
      c3(channels, channels, init.sub("c3"), true, 1),
      norm_(norm) {}

Var SpadainBlock::operator()(Context& ctx, const Var& x, const Var& mesh) const {
  const ModuleScope path(scope);
  const auto normed = [&](const Var& y) { return norm_ ? instance_norm(y) : y; };
  const Var h = normed(x);
  const Var inner = normed(c1(ctx, n1(ctx, h, mesh, Activation::relu)));
  const Var outer = c2(ctx, n2(ctx, inner, mesh, Activation::relu));
  return outer + c3(ctx, n3(ctx, h, mesh, Activation::relu));
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
