#include "autograd/ops/points.h"

#include "autograd/kernels/points.h"

namespace restage {

Tensor knn(const Tensor& query, const Tensor& points, int64_t k) {
  const bool ok = query.rank() == 3 && points.rank() == 3 && query.size(0) == points.size(0) &&
                  query.size(2) == 3 && points.size(2) == 3 && k > 0 &&
                  query.dtype() == points.dtype();
  if (!ok)
    shape_error("knn", "query[n, m, 3], points[n, v, 3]", std::array{query, points},
                "shapes do not fit");
  require_one_device(std::array{query, points});
  Tensor out = Tensor::empty({query.size(0), query.size(1), std::min(k, points.size(1))},
                             DType::i32, points.device());
  launch(KnnArgs{query, points, out});
  return out;
}

Tensor fps(const Tensor& points, int64_t m) {
  constexpr const char* letters = "points[n, v, 3], 0 <= m <= v";
  if (points.rank() != 3 || points.size(2) != 3 || points.size(1) < 1)
    shape_error("fps", letters, std::array{points}, "needs points");
  if (m < 0 || m > points.size(1))
    shape_error(
        "fps", letters, std::array{points},
        "cannot choose " + std::to_string(m) + " of " + std::to_string(points.size(1)) + " points");
  Tensor out = Tensor::empty({points.size(0), m}, DType::i32, points.device());
  launch(FpsArgs{points, out});
  return out;
}

void AttentionPool::check(Inputs x) const {
  if (x[0].rank() != 3 || !(x[0].shape() == x[1].shape()) || x[0].size(1) < 1)
    shape_error(name, letters, x, "p, k and d must agree");
  if (!(scale > 0)) shape_error(name, letters, x, "the scale must be positive");
  require_floats(name, letters, x);
}

Tensor AttentionPool::forward(Inputs x, Saved& saved) const {
  Tensor y = empty_like(x[0], {x[0].size(0), x[0].size(2)});
  Tensor weights = empty_like(x[0]);
  launch(AttentionPoolArgs{x[0], x[1], y, weights, scale});
  saved.keep({x[1], weights, y});
  return y;
}

Grads AttentionPool::backward(const Saved& saved, const Tensor& gy, Needs) const {
  Tensor g_score = empty_like(gy, saved[0].shape());
  Tensor g_value = empty_like(gy, saved[0].shape());
  launch(AttentionPoolGradArgs{saved[0], saved[1], saved[2], gy, g_score, g_value, scale});
  return {g_score, g_value};
}

}  // namespace restage
