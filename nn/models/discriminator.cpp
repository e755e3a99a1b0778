#include "nn/models/discriminator.h"

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"

namespace restage {
namespace {

// Steps between 60 frames, of which the last layer makes one number.
constexpr int64_t kNknSteps = 59;

}  // namespace

Discriminator::Discriminator(const DiscriminatorConfig& c, const Init& init)
    : config(c), out(c.widths[3] + c.condition, 1, 4, init.sub("out")) {
  int64_t in = c.in;
  for (size_t i = 0; i < 4; ++i) {
    convs.emplace(in, c.widths[i], 4, init.sub("convs." + std::to_string(i)));
    if (i > 0) bns.emplace(c.widths[i], init);
    in = c.widths[i] + (i > 0 ? c.condition : 0);
  }
}

Var Discriminator::operator()(Context& ctx, const Var& x, const Var& condition) {
  const ModuleScope path(scope);
  const int64_t n = x.size(0);
  if (config.nkn_head && x.size(1) != kNknSteps)
    shape_error("discriminator", "x[n, t - 1, in], condition[n, b]",
                std::array{x.value, condition.value}, "with nkn_head t is 60 frames");
  Var h = leaky_relu(convs[0].same(ctx, x, 2), 0.2);
  for (size_t i = 1; i < convs.size(); ++i) {
    h = leaky_relu(bns[i - 1](ctx, convs[i].same(ctx, h, 2)), 0.2);
    h = concat({h, expand(reshape(condition, {n, 1, condition.size(1)}),
                          {n, h.size(1), condition.size(1)})},
               2);
  }
  if (config.nkn_head) return reshape(out.valid(ctx, h, 2), {n});
  return reshape(mean(out.same(ctx, h, 1), 1), {n});
}

void Discriminator::visit(Fields& f) {
  f("convs", convs);
  f("bns", bns);
  f("out", out);
}

Var discriminator_input(const Var& joints, const Var& trans) {
  const int64_t n = joints.size(0), t = joints.size(1), width = joints.size(2) * 3;
  const Var flat = reshape(joints, {n, t, width});
  return concat({slice(flat, 1, 1, t) - slice(flat, 1, 0, t - 1), slice(trans, 1, 1, t)}, 2);
}

}  // namespace restage
