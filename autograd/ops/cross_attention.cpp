#include "autograd/ops/cross_attention.h"

#include <algorithm>

#include "autograd/kernels/elementwise.h"
#include "autograd/kernels/matmul.h"
#include "autograd/kernels/reduce.h"

namespace restage {
namespace {

/// Some whole items of the batch, or some queries of one item.
struct Part {
  int64_t item, items, query, queries;
};

Tensor of_keys(const Tensor& x, const Part& p) { return x.rows(p.item, p.item + p.items); }

Tensor of_queries(const Tensor& x, const Part& p) {
  const Tensor items = of_keys(x, p);
  if (p.queries == x.size(1)) return items;
  return items.reshape({x.size(1), x.size(2)})
      .rows(p.query, p.query + p.queries)
      .reshape({1, p.queries, x.size(2)});
}

/// Calls `work(part)` for all of n items of t queries over m keys, in order.
template <class Work>
void in_parts(int64_t n, int64_t t, int64_t m, int64_t most, const Work& work) {
  if (t == 0) return;
  const int64_t items = std::max<int64_t>(most / (t * m), 1);
  const int64_t queries = items > 1 ? t : std::clamp<int64_t>(most / m, 1, t);
  for (int64_t i = 0; i < n; i += items)
    for (int64_t q = 0; q < t; q += queries)
      work(Part{i, std::min(items, n - i), q, std::min(queries, t - q)});
}

/// Room for the scores of a part; the parts of one call have at most two sizes.
class Scores {
 public:
  Scores(const Tensor& like, int64_t keys) : like_(like), keys_(keys) {}
  Tensor of(const Part& p) {
    const int64_t count = p.items * p.queries * keys_;
    if (!room_.defined() || room_.numel() < count)
      room_ = Tensor::empty({count}, like_.dtype(), like_.device());
    return room_.rows(0, count).reshape({p.items, p.queries, keys_});
  }

 private:
  const Tensor& like_;
  int64_t keys_;
  Tensor room_;
};

}  // namespace

void CrossAttention::check(Inputs x) const {
  for (const Tensor& t : x)
    if (t.rank() != 3 || t.size(0) != x[0].size(0))
      shape_error(name, letters, x, "needs three axes of one n");
  if (x[0].size(2) != x[1].size(2)) shape_error(name, letters, x, "d must agree");
  if (x[1].size(1) != x[2].size(1) || x[1].size(1) == 0)
    shape_error(name, letters, x, "needs as many values as keys, and one at least");
  require_floats(name, letters, x);
}

namespace {

/// softmax(factor q k^T) of a part, in `out`; `work` is changed.
void shares(const Tensor& q, const Tensor& k, double factor, MatmulPrecision precision,
            Tensor& work, Tensor& out) {
  Tensor& product = factor == 1 ? work : out;
  launch(MatmulArgs{.a = q, .b = k, .out = product, .transpose_b = true, .precision = precision});
  if (factor != 1) launch(UnaryArgs{Unary::scale, out, work, factor});
  launch(SoftmaxArgs{work, out, out.size(0) * out.size(1), out.size(2), 1});
}

}  // namespace

Tensor CrossAttention::forward(Inputs x, Saved& saved) const {
  const Tensor &q = x[0], &k = x[1], &v = x[2];
  Tensor y = Tensor::empty({q.size(0), q.size(1), v.size(2)}, q.dtype(), q.device());
  Scores first(q, k.size(1)), second(q, k.size(1));
  in_parts(q.size(0), q.size(1), k.size(1), most_scores, [&](const Part& p) {
    Tensor work = first.of(p), share = second.of(p), out = of_queries(y, p);
    shares(of_queries(q, p), of_keys(k, p), factor, precision, work, share);
    launch(MatmulArgs{.a = share, .b = of_keys(v, p), .out = out, .precision = precision});
  });
  saved.keep({q, k, v});
  return y;
}

Grads CrossAttention::backward(const Saved& saved, const Tensor& gy, Needs) const {
  const Tensor &q = saved[0], &k = saved[1], &v = saved[2];
  Grads g{empty_like(q), empty_like(k), empty_like(v)};
  if (q.size(1) == 0)
    for (size_t i = 1; i < 3; ++i) g[i] = Tensor::zeros(g[i].shape(), q.dtype(), q.device());
  Scores first(q, k.size(1)), second(q, k.size(1));
  in_parts(q.size(0), q.size(1), k.size(1), most_scores, [&](const Part& p) {
    const Tensor qp = of_queries(q, p), kp = of_keys(k, p), vp = of_keys(v, p);
    const Tensor gyp = of_queries(gy, p);
    const bool more = p.query > 0;  // an item's earlier queries have left their part
    Tensor work = first.of(p), share = second.of(p);
    Tensor gq = of_queries(g[0], p), gk = of_keys(g[1], p), gv = of_keys(g[2], p);
    shares(qp, kp, factor, precision, work, share);
    launch(MatmulArgs{.a = share,
                      .b = gyp,
                      .out = gv,
                      .transpose_a = true,
                      .accumulate = more,
                      .precision = precision});
    Tensor score = Tensor::empty(work.shape(), q.dtype(), q.device());
    launch(MatmulArgs{.a = gyp, .b = vp, .out = work, .transpose_b = true, .precision = precision});
    launch(SoftmaxGradArgs{share, work, score, share.size(0) * share.size(1), share.size(2), 1});
    if (factor != 1) launch(UnaryArgs{Unary::scale, score, work, factor});
    const Tensor& slope = factor == 1 ? score : work;
    launch(MatmulArgs{.a = slope, .b = kp, .out = gq, .precision = precision});
    launch(MatmulArgs{.a = slope,
                      .b = qp,
                      .out = gk,
                      .transpose_a = true,
                      .accumulate = more,
                      .precision = precision});
  });
  return g;
}

}  // namespace restage
