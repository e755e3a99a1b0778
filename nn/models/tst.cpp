#include "nn/models/tst.h"

#include <string>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/norm.h"
#include "nn/models/npt.h"

namespace restage {

Tst::Tst(const TstConfig& c, const Init& init)
    : config(c),
      t_in(3 * c.vertices, c.code, init.sub("t_in")),
      t_out(c.hidden, 3 * c.vertices, init.sub("t_out")),
      lstm(c.code, c.hidden, static_cast<int>(c.layers), init.sub("lstm")),
      out((c.widths[2] + 6) / 4, 3, init.sub("out"), true, 1) {
  int64_t in = 3;
  for (size_t i = 0; i < c.widths.size(); ++i) {
    enc.emplace(in, c.widths[i], init.sub("enc." + std::to_string(i)), true, 1);
    in = c.widths[i];
  }
  const int64_t full = in = c.widths[2] + 6;
  size_t i = 0;
  for (const int64_t width : {full, full / 2, full / 4}) {
    const std::string number = std::to_string(i);
    convs.emplace(in, width, init.sub("convs." + number), true, 1);
    blocks.emplace(width, true, init.sub("blocks." + number));
    in = width;
    ++i;
  }
}

Var Tst::encode(Context& ctx, const Var& pose) const {
  const int64_t n = pose.size(0), t = pose.size(1), v = pose.size(2);
  if (v != config.vertices)
    shape_error("tst", "pose[n, t, v, 3]", std::array{pose.value},
                "the network is made for " + std::to_string(config.vertices) + " vertices");
  // All x of a frame, then all y, then all z.
  const Var flat = reshape(permute(pose, {0, 1, 3, 2}), {n, t, 3 * v});
  const Var h = lstm(ctx, t_in(ctx, flat, Activation::relu));
  const Var moved = permute(reshape(tanh(t_out(ctx, h)), {n, t, 3, v}), {0, 1, 3, 2});
  Var x = reshape(pose, {n * t, v, 3});
  for (size_t i = 0; i < enc.size(); ++i) x = leaky_relu(enc[i](ctx, x), 0.01);
  return concat({reshape(x, {n, t, v, x.size(2)}), moved}, 3);
}

Var Tst::decode(Context& ctx, const Var& code, const Var& identity) const {
  Var x = concat({code, identity}, 2);
  for (size_t i = 0; i < convs.size(); ++i)
    x = blocks[i](ctx, instance_norm(convs[i](ctx, x)), identity);
  return points_of(ctx, out, x);
}

Var Tst::window(Context& ctx, const Var& pose, const Var& identity) const {
  const ModuleScope path(scope);
  const int64_t t = pose.size(0), v = pose.size(1);
  const Var code = encode(ctx, reshape(pose, {1, t, v, 3}));
  return decode(ctx, reshape(code, {t, v, code.size(3)}), identity);
}

Var Tst::forward(Context& ctx, const TransferInput& in) {
  const ModuleScope path(scope);
  const int64_t n = in.pose.size(0), t = in.pose.size(1), v = in.identity.size(1);
  const Var code = encode(ctx, in.pose);
  if (v != config.vertices)
    shape_error("tst", "identity[n, v, 3]", std::array{in.identity.value},
                "the network is made for " + std::to_string(config.vertices) + " vertices");
  const Var mesh = repeat_items(in.identity, t);
  const Var posed = decode(ctx, reshape(code, {n * t, v, code.size(3)}), mesh);
  return reshape(posed, {n, t, v, 3});
}

void Tst::visit(Fields& f) {
  f("enc", enc);
  f("t_in", t_in);
  f("t_out", t_out);
  f("lstm", lstm);
  f("convs", convs);
  f("blocks", blocks);
  f("out", out);
}

TstDiscriminator::TstDiscriminator(const TstDiscriminatorConfig& c, const Init& init)
    : config(c),
      fc1(3 * c.vertices, c.widths[0], init.sub("fc1")),
      fc2(c.widths[0], c.widths[1], init.sub("fc2")),
      fc3(c.widths[1], 1, init.sub("fc3")) {}

Var TstDiscriminator::logits(Context& ctx, const Var& vertices) const {
  const ModuleScope path(scope);
  const Var x = reshape(vertices, {vertices.size(0), 3 * vertices.size(1)});
  return fc3(ctx, fc2(ctx, fc1(ctx, x, Activation::relu), Activation::relu));
}

Var TstDiscriminator::operator()(Context& ctx, const Var& vertices) const {
  return sigmoid(logits(ctx, vertices));
}

void TstDiscriminator::visit(Fields& f) {
  f("fc1", fc1);
  f("fc2", fc2);
  f("fc3", fc3);
}

}  // namespace restage
