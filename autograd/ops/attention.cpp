#include "autograd/ops/attention.h"

#include "autograd/kernels/attention.h"
#include "autograd/kernels/layout.h"

namespace restage {
namespace {

NeighbourAttentionInputs kernel_inputs(const NeighbourAttention& op, const Tensor* x) {
  return {x[0], op.index, x[1], x[2],     x[3],     x[4],
          x[5], x[6],     x[7], op.scale, op.dense, op.precision};
}

}  // namespace

void NeighbourAttention::check(Inputs x) const {
  const auto is = [&](size_t i, const Shape& shape) { return x[i].shape() == shape; };
  if (x.size() != 9 || x[0].rank() != 3 || x[0].size(2) != 3 || x[1].rank() != 3)
    shape_error(name, letters, x, "wrong number of axes");
  const int64_t n = x[0].size(0), v = x[0].size(1), d = x[1].size(2);
  const Shape rows{n, v, d};
  if (!is(1, rows) || !is(2, rows) || !is(3, rows))
    shape_error(name, letters, x, "n, v and d must agree");
  if (!is(4, {d, 3}) || !is(5, {d}) || !is(6, {2 * d, d}) || !is(7, {d, d}) || !is(8, {d}))
    shape_error(name, letters, x, "d must agree");
  if (index.dtype() != DType::i32 || index.rank() != 3 || index.size(0) != n ||
      index.size(1) != v || index.size(2) < 1)
    shape_error(name, letters, x, "the index must be i32 [n, v, k > 0]");
  if (!(scale > 0)) shape_error(name, letters, x, "the scale must be positive");
  require_one_device(std::array{x[0], index});
  if (index.device() == Device{} && !index_within(index, v))
    shape_error(name, letters, x, "an index is out of range");
  require_floats(name, letters, x);
}

Tensor NeighbourAttention::forward(Inputs x, Saved& saved) const {
  Tensor y = empty_like(x[1]);
  Tensor weights;
  if (saved.on())
    weights = empty_like(x[1], {x[1].size(0), x[1].size(1), index.size(2), x[1].size(2)});
  launch(
      NeighbourAttentionArgs{kernel_inputs(*this, x.data()), y, saved.on() ? &weights : nullptr});
  saved.keep({x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], weights, y, index});
  return y;
}

Grads NeighbourAttention::backward(const Saved& saved, const Tensor& gy, Needs needs) const {
  Grads g(9);
  for (size_t i = 0; i < 8; ++i)
    if (i > 0 || needs[0]) g[i] = empty_like(gy, saved[i].shape());
  launch(NeighbourAttentionGradArgs{kernel_inputs(*this, &saved[0]), saved[8], saved[9], gy,
                                    needs[0] ? &g[0] : nullptr, g[1], g[2], g[3], g[4], g[5], g[6],
                                    g[7]});
  g[8] = Tensor::zeros(saved.shape(8), gy.dtype(), gy.device());
  for (size_t i = 0; i < g.size(); ++i)
    if (!needs[i]) g[i] = Tensor();
  return g;
}

}  // namespace restage
