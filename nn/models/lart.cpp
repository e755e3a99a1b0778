#include "nn/models/lart.h"

#include <string>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"
#include "nn/models/npt.h"

namespace restage {

Lart::Lart(const LartConfig& c, const Init& given)
    : config(c),
      time(Tensor::zeros({c.frames, c.widths[2]}, given.type)),
      enc(c.widths, given.begun(c.own_start, Start::normal).sub("enc")),
      out(c.widths[2] / 4, 3, given.begun(c.own_start, Start::normal).sub("out"), true, 1) {
  const Init init = given.begun(c.own_start, Start::normal);
  const int64_t full = c.widths[2];
  int64_t in = full;
  size_t i = 0;
  for (const int64_t width : {full, full / 2, full / 2, full / 4}) {
    const std::string number = std::to_string(i);
    convs.emplace(in, width, init.sub("convs." + number), true, 1);
    att.emplace(width, init.sub("att." + number));
    blocks.emplace(width, i > 0 || c.first_norm, init.sub("blocks." + number));
    in = width;
    ++i;
  }
}

Var Lart::codes(Context& ctx, const Var& pose, bool last) const {
  const int64_t n = pose.size(0), t = pose.size(1), from = last ? t - 1 : 0, frames = t - from;
  if (t > config.frames)
    shape_error("lart", "pose[n, t, p, 3]", std::array{pose.value},
                "the model has vectors for " + std::to_string(config.frames) + " frames");
  const Var wanted = reshape(slice(pose, 1, from, t), {n * frames, pose.size(2), 3});
  const Var pooled = max(enc(ctx, wanted), 1);
  return reshape(pooled, {n, frames, pooled.size(1)}) + slice(ctx.bind(time), 0, from, t);
}

Var Lart::decode(Context& ctx, const Var& code, const Var& identity) const {
  const int64_t n = code.size(0), t = code.size(1), v = identity.size(1);
  const Var mesh = repeat_items(identity, t);
  // The target is encoded once for all frames. The code is one row for all its vertices until the
  // first block, which gives each a row of its own.
  Var u = enc(ctx, identity), x = reshape(code, {n * t, 1, code.size(2)});
  for (size_t i = 0; i < convs.size(); ++i) {
    u = convs[i](ctx, u);
    x = convs[i](ctx, x);
    x = blocks[i](ctx, att[i](ctx, u, x, x), mesh);
  }
  return reshape(points_of(ctx, out, x), {n, t, v, 3});
}

Var Lart::forward(Context& ctx, const TransferInput& in) {
  const ModuleScope path(scope);
  return decode(ctx, codes(ctx, in.pose, in.last), in.identity);
}

std::optional<Var> Lart::between(Context& ctx, const TransferInput& in, double share) const {
  const ModuleScope path(scope);
  const Var code = codes(ctx, in.pose, true);
  const Var mixed = scale(slice(code, 0, 0, 1), 1 - share) + scale(slice(code, 0, 1, 2), share);
  return decode(ctx, mixed, in.identity);
}

void Lart::visit(Fields& f) {
  f("time", time);
  f("enc", enc);
  f("convs", convs);
  f("att", att);
  f("blocks", blocks);
  f("out", out);
}

}  // namespace restage
