#include "nn/layers/self_attention.h"

#include <cmath>

#include "autograd/ops/cross_attention.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"

namespace restage {

EncoderLayer::EncoderLayer(int64_t width, int64_t heads, int64_t hidden, const Init& init)
    : norm1(width, init),
      qkv(width, 3 * width, init.sub("qkv")),
      out(width, width, init.sub("out")),
      norm2(width, init),
      fc1(width, hidden, init.sub("fc1")),
      fc2(hidden, width, init.sub("fc2")),
      heads_(heads) {}

Var EncoderLayer::attention(Context& ctx, const Var& x) const {
  const int64_t n = x.size(0), t = x.size(1), width = x.size(2), per_head = width / heads_;
  // [n, t, 3, heads, c] -> [3, n * heads, t, c]
  const Var all = permute(reshape(qkv(ctx, x), {n, t, 3, heads_, per_head}), {2, 0, 3, 1, 4});
  const Vars parts = split(all, 0, {1, 1, 1});
  const auto part = [&](size_t i) { return reshape(parts[i], {n * heads_, t, per_head}); };
  const double factor = 1.0 / std::sqrt(static_cast<double>(per_head));
  const Var mixed =
      reshape(cross_attention(part(0), part(1), part(2), factor), {n, heads_, t, per_head});
  return out(ctx, reshape(permute(mixed, {0, 2, 1, 3}), {n, t, width}));
}

Var EncoderLayer::operator()(Context& ctx, const Var& x) const {
  const ModuleScope path(scope);
  const Var y = x + attention(ctx, norm1(ctx, x));
  return y + fc2(ctx, fc1(ctx, norm2(ctx, y), Activation::relu));
}

void EncoderLayer::visit(Fields& f) {
  f("norm1", norm1);
  f("qkv", qkv);
  f("out", out);
  f("norm2", norm2);
  f("fc1", fc1);
  f("fc2", fc2);
}

}  // namespace restage
