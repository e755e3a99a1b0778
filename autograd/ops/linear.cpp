#include "autograd/ops/linear.h"

#include "autograd/kernels/elementwise.h"
#include "autograd/kernels/reduce.h"
#include "autograd/ops/elementwise.h"

namespace restage {
namespace {

Tensor product(const Tensor& a, const Tensor& b, bool ta, bool tb) {
  Shape shape;
  if (a.rank() == 3 || b.rank() == 3) shape.push_back(a.rank() == 3 ? a.size(0) : b.size(0));
  shape.push_back(a.size(ta ? -1 : -2));
  shape.push_back(b.size(tb ? -2 : -1));
  Tensor y = Tensor::empty(shape, a.dtype(), a.device());
  launch(MatmulArgs{a, b, y, ta, tb});
  return y;
}

/// A gradient of a matrix that was shared by a batch.
Tensor unshare(const Tensor& g, const Tensor& of) {
  return g.rank() == of.rank() ? g : sum_to(g, of.shape());
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
  Tensor y = Tensor::empty(shape, x[0].dtype(), x[0].device());
  Tensor rows = y.reshape({flat.size(0), x[1].size(0)});
  launch(MatmulArgs{flat, x[1], rows, false, true, x.size() > 2 ? &x[2] : nullptr, activation});
  if (activation == Activation::relu) {
    saved.keep({x[0], x[1], y});
  } else {
    saved.keep({x[0], x[1]});
  }
  return y;
}

Grads LinearOp::backward(const Saved& saved, const Tensor& gy, Needs needs) const {
  const Tensor &x = saved[0], &w = saved[1];
  Tensor g = gy;
  if (activation == Activation::relu) {
    g = Tensor::empty(gy.shape(), gy.dtype(), gy.device());
    launch(UnaryGradArgs{Unary::relu, saved[2], saved[2], gy, g});
  }
  const int64_t rows = x.shape().product(0, x.rank() - 1);
  g = g.reshape({rows, w.size(0)});
  Grads out(needs.size());
  if (needs[0]) {
    out[0] = Tensor::empty(x.shape(), gy.dtype(), gy.device());
    Tensor flat = out[0].reshape({rows, w.size(1)});
    launch(MatmulArgs{g, w, flat});
  }
  if (needs[1]) out[1] = product(g, x.reshape({rows, w.size(1)}), true, false);
  if (needs.size() > 2 && needs[2]) {
    out[2] = Tensor::empty({w.size(0)}, gy.dtype(), gy.device());
    launch(SumArgs{g, out[2], 1, rows, w.size(0)});
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
  saved.keep({x[0], x[1]});
  return product(x[0], x[1], transpose_a, transpose_b);
}

Grads Matmul::backward(const Saved& saved, const Tensor& gy, Needs needs) const {
  const Tensor &a = saved[0], &b = saved[1];
  Grads g(2);
  if (needs[0])
    g[0] = unshare(
        transpose_a ? product(b, gy, transpose_b, true) : product(gy, b, false, !transpose_b), a);
  if (needs[1])
    g[1] = unshare(
        transpose_b ? product(gy, a, true, transpose_a) : product(a, gy, !transpose_a, false), b);
  return g;
}

}  // namespace restage
