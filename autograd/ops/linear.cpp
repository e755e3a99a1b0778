#include "autograd/ops/linear.h"

#include "autograd/kernels/elementwise.h"
#include "autograd/kernels/reduce.h"
#include "autograd/ops/elementwise.h"

namespace restage {
namespace {

Tensor product(const Tensor& a, const Tensor& b, bool ta, bool tb, MatmulPrecision precision) {
  Shape shape;
  if (a.rank() == 3 || b.rank() == 3) shape.push_back(a.rank() == 3 ? a.size(0) : b.size(0));
  shape.push_back(a.size(ta ? -1 : -2));
  shape.push_back(b.size(tb ? -2 : -1));
  Tensor y = empty_like(a, shape);
  launch(MatmulArgs{
      .a = a, .b = b, .out = y, .transpose_a = ta, .transpose_b = tb, .precision = precision});
  return y;
}

/// The gradient of a matrix: of one that a batch shares, the sum over the batch.
Tensor unshare(const Tensor& g, const Shape& of) {
  return g.rank() == of.rank() ? g : sum_to(g, of);
}

}  // namespace

void LinearOp::check(Inputs x) const {
  if (x[0].rank() < 1 || x[1].rank() != 2 || x[0].size(-1) != x[1].size(1))
    shape_error(name, letters, x, "i must agree");
  if (x.size() > 2 && (x[2].rank() != 1 || x[2].size(0) != x[1].size(0)))
    shape_error(name, letters, x, "o must agree");
  require_floats(name, letters, x);
}

Tensor LinearOp::forward(Inputs x, Saved& saved) const {
  const Tensor flat = x[0].reshape({x[0].shape().product(0, x[0].rank() - 1), x[0].size(-1)});
  Shape shape = x[0].shape();
  shape.set(-1, x[1].size(0));
  Tensor y = empty_like(x[0], shape);
  Tensor rows = y.reshape({flat.size(0), x[1].size(0)});
  launch(MatmulArgs{.a = flat,
                    .b = x[1],
                    .out = rows,
                    .transpose_b = true,
                    .bias = x.size() > 2 ? &x[2] : nullptr,
                    .activation = activation,
                    .precision = precision});
  saved.keep({saved.needs(1) ? x[0] : Tensor(), saved.needs(0) ? x[1] : Tensor(),
              activation == Activation::relu ? y : Tensor()});
  return y;
}

Grads LinearOp::backward(const Saved& saved, const Tensor& gy, Needs needs) const {
  const Shape& x = saved.shape(0);
  const int64_t rows = x.product(0, x.rank() - 1), i = saved.shape(1)[1], o = saved.shape(1)[0];
  Tensor g = gy;
  if (activation == Activation::relu) {
    g = empty_like(gy);
    launch(UnaryGradArgs{Unary::relu, &saved[2], gy, g});
  }
  g = g.reshape({rows, o});
  Grads out(needs.size());
  if (needs[0]) out[0] = product(g, saved[1], false, false, precision).reshape(x);
  if (needs[1]) out[1] = product(g, saved[0].reshape({rows, i}), true, false, precision);
  if (needs.size() > 2 && needs[2]) {
    out[2] = empty_like(gy, {o});
    launch(SumArgs{g, out[2], 1, rows, o});
  }
  return out;
}

void Matmul::check(Inputs x) const {
  const Tensor &a = x[0], &b = x[1];
  if (a.rank() < 2 || a.rank() > 3 || b.rank() < 2 || b.rank() > 3)
    shape_error(name, letters, x, "needs matrices");
  if (a.size(transpose_a ? -2 : -1) != b.size(transpose_b ? -1 : -2))
    shape_error(name, letters, x, "k must agree");
  if (a.rank() == 3 && b.rank() == 3 && a.size(0) != b.size(0))
    shape_error(name, letters, x, "b must agree");
  require_floats(name, letters, x);
}

Tensor Matmul::forward(Inputs x, Saved& saved) const {
  saved.keep({saved.needs(1) ? x[0] : Tensor(), saved.needs(0) ? x[1] : Tensor()});
  return product(x[0], x[1], transpose_a, transpose_b, precision);
}

Grads Matmul::backward(const Saved& saved, const Tensor& gy, Needs needs) const {
  const Tensor &a = saved[0], &b = saved[1];
  Grads g(2);
  const auto times = [this](const Tensor& l, const Tensor& r, bool tl, bool tr) {
    return product(l, r, tl, tr, precision);
  };
  if (needs[0])
    g[0] =
        unshare(transpose_a ? times(b, gy, transpose_b, true) : times(gy, b, false, !transpose_b),
                saved.shape(0));
  if (needs[1])
    g[1] =
        unshare(transpose_b ? times(gy, a, true, transpose_a) : times(a, gy, !transpose_a, false),
                saved.shape(1));
  return g;
}

}  // namespace restage
