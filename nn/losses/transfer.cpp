#include "nn/losses/transfer.h"

#include <algorithm>
#include <array>

#include "autograd/kernels/layout.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"

namespace restage {
namespace {

constexpr double kNothing = 1e-24;  // square metres: below any distance, above float32's least

/// The lengths of the three edges of every face of `places` [n, 3 f], vertices of x [n, v, 3]:
/// [n, 3 f].
Var edge_lengths(const Var& x, const Tensor& places) {
  const int64_t n = places.size(0), corners = places.size(1);
  const Var from = reshape(gather(x, places), {n, corners / 3, 9});
  const Var to = concat({slice(from, 2, 3, 9), slice(from, 2, 0, 3)}, 2);
  return smooth_length(reshape(from - to, {n, corners, 3}), kNothing);
}

/// faces [m, f, 3] or [f, 3] of n items, as places [n, 3 f].
Tensor places_of(const Tensor& faces, int64_t n) {
  const int64_t f = faces.size(-2), m = faces.rank() == 2 ? 1 : faces.size(0);
  const Tensor each = faces.reshape({m, 3 * f});
  if (m == n) return each;
  Tensor out = Tensor::empty({n, 3 * f}, DType::i32, faces.device());
  for (int64_t i = 0; i < n; ++i)
    launch(CopyBlocksArgs{.x = each,
                          .out = out,
                          .outer = 1,
                          .count = 3 * f,
                          .x_stride = 0,
                          .x_offset = i / (n / m) * 3 * f,
                          .out_stride = 0,
                          .out_offset = i * 3 * f});
  return out;
}

/// 1 / how many faces of each item have three corners, [n].
Tensor shares_of(const Tensor& faces, int64_t n) {
  const Tensor host = faces.cpu();
  const int64_t f = faces.size(-2), m = faces.rank() == 2 ? 1 : faces.size(0);
  std::vector<double> shares;
  for (int64_t i = 0; i < m; ++i) {
    int64_t count = 0;
    const int32_t* face = host.data<int32_t>() + i * 3 * f;
    for (int64_t k = 0; k < f; ++k, face += 3)
      count += face[0] != face[1] && face[1] != face[2] && face[0] != face[2];
    shares.insert(shares.end(), static_cast<size_t>(n / m),
                  1 / static_cast<double>(std::max<int64_t>(count, 1)));
  }
  return Tensor::from<double>({n}, shares);
}

/// 1 where a length is above a nanometre, else 0, without a look at the host.
Tensor mask_of(const Var& lengths) {
  const Var above = scale(relu(add_scalar(lengths, -1e-9)), 1e15);
  return add_scalar(neg(relu(add_scalar(neg(above), 1))), 1).value;
}

}  // namespace

Var edge_loss(const Var& pred, const Tensor& reference, const Tensor& faces) {
  const int64_t n = pred.size(0);
  if (faces.rank() < 2 || faces.rank() > 3 || faces.size(-1) != 3 || faces.size(-2) == 0 ||
      (faces.rank() == 3 && (faces.size(0) == 0 || n % faces.size(0) != 0)) ||
      reference.shape() != pred.shape())
    shape_error("edge_loss",
                "pred[n, v, 3], reference[n, v, 3], faces[m?, f, 3], m divides n, f > 0",
                std::array{pred.value, reference, faces}, "a mesh with faces is needed");
  // The host counts while the device still has work from before.
  const Tensor shares = shares_of(faces, n).cast(pred.dtype()).to(pred.value.device());
  const Tensor places = places_of(faces, n).to(pred.value.device());
  const Var right = edge_lengths(Var(reference), places);
  const Tensor mask = mask_of(right);
  const Var ratios = edge_lengths(pred, places) * Var((Var(mask) / right).value);
  return sum(abs(ratios - Var(mask)), 1) * Var(shares);
}

Var pair_distances(const Var& x) {
  const int64_t n = x.size(0), v = x.size(1);
  return smooth_length(reshape(x, {n, v, 1, 3}) - reshape(x, {n, 1, v, 3}), kNothing);
}

Var metric_loss(const Var& pred, const Tensor& first, const Tensor& last, double alpha) {
  const Var wanted = pair_distances(Var(first)) * (1 - alpha) + pair_distances(Var(last)) * alpha;
  return mse(pair_distances(pred), wanted);
}

TstLosses tst_losses(const Var& pred, const Tensor& truth, const Tensor& identity,
                     const Tensor& faces, const Var& real) {
  const auto v = static_cast<double>(pred.size(1));
  TstLosses out;
  out.adversarial = mean_all(neg(log(real)));
  out.reconstruction = sum_all(square(pred - Var(truth)));
  out.edge = sum_all(edge_loss(pred, identity, faces));
  out.distances = sum_all(square(pair_distances(pred) - pair_distances(Var(truth)))) *
                  (1 / std::max(v * (v - 1), 1.0));
  out.total = out.adversarial + out.reconstruction * 2 + out.edge * 0.5 + out.distances * 0.5;
  return out;
}

}  // namespace restage
