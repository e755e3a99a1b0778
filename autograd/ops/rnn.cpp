#include "autograd/ops/rnn.h"

#include "autograd/kernels/elementwise.h"
#include "autograd/kernels/layout.h"
#include "autograd/kernels/matmul.h"
#include "autograd/kernels/reduce.h"
#include "autograd/kernels/rnn.h"

namespace restage {
namespace {

Tensor column_sum(const Tensor& g) {  // [t, n, c] -> [c]
  Tensor out = empty_like(g, {g.size(2)});
  launch(SumArgs{g, out, 1, g.size(0) * g.size(1), g.size(2)});
  return out;
}

Tensor flat(const Tensor& x) { return x.reshape({x.size(0) * x.size(1), x.size(2)}); }

}  // namespace

void Gru::check(Inputs x) const {
  const bool ranks = x.size() == 6 && x[0].rank() == 3 && x[1].rank() == 2 && x[2].rank() == 2 &&
                     x[3].rank() == 2 && x[4].rank() == 1 && x[5].rank() == 1;
  if (!ranks) shape_error(name, letters, x, "wrong number of axes");
  const int64_t n = x[0].size(1), i = x[0].size(2), h = x[1].size(1);
  if (h < 1) shape_error(name, letters, x, "h must be positive: there is no hidden unit");
  if (x[1].size(0) != n) shape_error(name, letters, x, "n must agree");
  if (x[2].size(1) != i) shape_error(name, letters, x, "i must agree");
  if (x[2].size(0) != 3 * h || x[3].size(0) != 3 * h || x[3].size(1) != h ||
      x[4].size(0) != 3 * h || x[5].size(0) != 3 * h)
    shape_error(name, letters, x, "h must agree");
  require_floats(name, letters, x);
}

Tensor Gru::forward(Inputs in, Saved& saved) const {
  const Tensor &x = in[0], &h0 = in[1], &w_ih = in[2], &w_hh = in[3];
  const int64_t t_count = x.size(0), n = x.size(1), h = h0.size(1);
  Tensor y = empty_like(x, {t_count, n, h}), gates;
  if (saved.on()) gates = empty_like(x, {t_count, n, 4 * h});
  launch(GruArgs{x, h0, w_ih, w_hh, in[4], in[5], y, saved.on() ? &gates : nullptr, precision});
  saved.keep({x, h0, w_ih, w_hh, y, gates});
  return y;
}

Grads Gru::backward(const Saved& saved, const Tensor& gy, Needs needs) const {
  const Tensor &x = saved[0], &h0 = saved[1], &w_ih = saved[2], &w_hh = saved[3], &y = saved[4],
               &gates = saved[5];
  const int64_t t_count = x.size(0), n = x.size(1), h = h0.size(1);
  Tensor g_gi = empty_like(x, {t_count, n, 3 * h});
  Tensor g_gh = empty_like(x, {t_count, n, 3 * h});
  Tensor g_h0 = empty_like(x, {n, h});
  launch(GruGradArgs{gates, y, h0, w_hh, gy, g_gi, g_gh, g_h0});
  const auto product = [this](const Tensor& a, const Tensor& b, Tensor& out, bool transpose_a) {
    launch(
        MatmulArgs{.a = a, .b = b, .out = out, .transpose_a = transpose_a, .precision = precision});
  };
  Grads g(6);
  if (needs[0]) {
    g[0] = empty_like(x);
    Tensor rows = flat(g[0]);
    product(flat(g_gi), w_ih, rows, false);
  }
  if (needs[1]) g[1] = g_h0;
  if (needs[2]) {
    g[2] = empty_like(x, w_ih.shape());
    product(flat(g_gi), flat(x), g[2], true);
  }
  if (needs[3]) {
    // States before each step: h0 followed by all but the last output.
    Tensor before = empty_like(x, y.shape());
    launch(CopyBlocksArgs{h0, before, t_count > 0 ? 1 : 0, n * h, n * h, 0, n * h, 0});
    if (t_count > 1) {
      Tensor rest = before.rows(1, t_count);
      launch(CopyBlocksArgs{y, rest, t_count - 1, n * h, n * h, 0, n * h, 0});
    }
    g[3] = empty_like(x, w_hh.shape());
    product(flat(g_gh), flat(before), g[3], true);
  }
  if (needs[4]) g[4] = column_sum(g_gi);
  if (needs[5]) g[5] = column_sum(g_gh);
  return g;
}

void Recurrence::check(Inputs x) const {
  if (x[0].rank() != 3 || x[2].rank() != 2) shape_error(name, letters, x, "wrong number of axes");
  if (!(x[0].shape() == x[1].shape())) shape_error(name, letters, x, "a and b must agree");
  if (x[2].size(0) != x[0].size(0)) shape_error(name, letters, x, "n must agree");
  if (x[2].size(1) != x[0].size(2)) shape_error(name, letters, x, "m must agree");
  require_floats(name, letters, x);
}

Tensor Recurrence::forward(Inputs x, Saved& saved) const {
  Tensor y = empty_like(x[0]);
  launch(RecurrenceArgs{x[0], x[1], x[2], y});
  saved.keep({x[0], x[2], y});
  return y;
}

Grads Recurrence::backward(const Saved& saved, const Tensor& gy, Needs) const {
  Grads g{empty_like(gy), empty_like(gy), empty_like(saved[1])};
  launch(RecurrenceGradArgs{saved[0], saved[2], saved[1], gy, g[0], g[2], g[1]});
  return g;
}

}  // namespace restage
