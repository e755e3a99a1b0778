#include "autograd/ops/transport.h"

#include <vector>

#include "autograd/kernels/matmul.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/linear.h"

namespace restage {
namespace {

/// A column [n, m, 1] as a row [n, 1, m].
Var as_row(const Var& column) { return reshape(column, {column.size(0), 1, column.size(1)}); }

}  // namespace

void Sinkhorn::check(Inputs x) const {
  if (x[0].rank() != 3 || x[0].size(1) < 1 || x[0].size(2) < 1)
    shape_error(name, letters, x, "needs three axes, v > 0 and p > 0");
  if (steps < 1) shape_error(name, letters, x, "needs one step at least");
  require_floats(name, letters, x);
}

Tensor Sinkhorn::forward(Inputs x, Saved& saved) const {
  const Var k(x[0]);
  const auto uniform = [&](int64_t m) {
    return Var(
        Tensor::full({k.size(0), m, 1}, 1.0 / static_cast<double>(m), k.dtype(), x[0].device()));
  };
  const Var row = uniform(k.size(1)), column = uniform(k.size(2));
  Var a = row, b;
  std::vector<Tensor> kept{x[0], a.value};  // then b and a of each step
  for (int i = 0; i < steps; ++i) {
    b = column / add_scalar(matmul(k, a, true), epsilon);
    a = row / add_scalar(matmul(k, b), epsilon);
    kept.insert(kept.end(), {b.value, a.value});
  }
  saved.keep_all(std::move(kept));
  return (a * k * as_row(b)).value;
}

Grads Sinkhorn::backward(const Saved& saved, const Tensor& gy, Needs) const {
  const auto a = [&](int step) { return Var(saved[static_cast<size_t>(2 * step + 1)]); };
  const auto b = [&](int step) { return Var(saved[static_cast<size_t>(2 * step)]); };  // from 1 on
  const Var k(saved[0]), g(gy), of_plan = g * k;
  const auto v = static_cast<double>(k.size(1)), p = static_cast<double>(k.size(2));
  Var ga = matmul(of_plan, b(steps)), gb = matmul(of_plan, a(steps), true);
  std::vector<Var> left, right;  // rows: of the outer products that the sums of the steps add
  for (int i = steps; i > 0; --i) {
    const Var g_row = scale(ga * a(i) * a(i), -v);  // of K b + epsilon
    const Var through = matmul(k, g_row, true);
    gb = i == steps ? gb + through : through;
    const Var g_column = scale(gb * b(i) * b(i), -p);  // of K' a + epsilon
    ga = matmul(k, g_column);
    left.insert(left.end(), {as_row(g_row), as_row(a(i - 1))});
    right.insert(right.end(), {as_row(b(i)), as_row(g_column)});
  }
  Tensor out = (g * a(steps) * as_row(b(steps))).value;
  const Var rows = concat(left, 1), columns = concat(right, 1);
  launch(MatmulArgs{
      .a = rows.value, .b = columns.value, .out = out, .transpose_a = true, .accumulate = true});
  return {out};
}

}  // namespace restage
