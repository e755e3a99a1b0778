#include "nn/models/npt.h"

#include <string>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/linear.h"
#include "autograd/ops/reduce.h"

namespace restage {

Var points_of(Context& ctx, const Linear& out, const Var& x) { return scale(tanh(out(ctx, x)), 2); }

Npt::Npt(const NptConfig& c, const Init& given)
    : config(c),
      enc(c.widths, given.begun(c.own_start, Start::normal).sub("enc")),
      out((c.widths[2] + 3) / 4, 3, given.begun(c.own_start, Start::normal).sub("out"), true, 1) {
  const Init init = given.begun(c.own_start, Start::normal);
  const int64_t full = c.widths[2] + 3;
  int64_t in = full;
  size_t i = 0;
  for (const int64_t width : {full, full / 2, full / 4}) {
    const std::string number = std::to_string(i);
    convs.emplace(in, width, init.sub("convs." + number), true, 1);
    blocks.emplace(width, !(c.pool && i == 0), init.sub("blocks." + number));
    in = width;
    ++i;
  }
}

Var Npt::join(Context& ctx, const Var& code, const Var& mesh) const {
  const Vars w = split(convs[0].matrix(ctx), 1, {code.size(2), 3});
  return linear(code, w[0]) + linear(mesh, w[1], ctx.bind(convs[0].bias));
}

Var Npt::forward(Context& ctx, const TransferInput& in) {
  const ModuleScope path(scope);
  const int64_t n = in.pose.size(0), t = in.pose.size(1), p = in.pose.size(2);
  const int64_t v = in.identity.size(1);
  if (!config.pool && p != v)
    shape_error("npt", "pose[n, t, v, 3], identity[n, v, 3]",
                std::array{in.pose.value, in.identity.value},
                "without 'pool' the pose needs as many points as the target has vertices");
  const Var mesh = repeat_items(in.identity, t);
  Var z = enc(ctx, reshape(in.pose, {n * t, p, 3}));
  if (config.pool) z = reshape(max(z, 1), {n * t, 1, z.size(2)});
  Var x = blocks[0](ctx, join(ctx, z, mesh), mesh);
  for (size_t i = 1; i < convs.size(); ++i) x = blocks[i](ctx, convs[i](ctx, x), mesh);
  return reshape(points_of(ctx, out, x), {n, t, v, 3});
}

void Npt::visit(Fields& f) {
  f("enc", enc);
  f("convs", convs);
  f("blocks", blocks);
  f("out", out);
}

}  // namespace restage
