#include "nn/losses/transfer.h"

#include <algorithm>
#include <array>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"

namespace restage {
namespace {

constexpr double kNothing = 1e-24;  // square metres: below any distance, above float32's least

/// The vertices [n, 3 f, 3] where the edges of all faces begin and end.
struct Ends {
  Tensor from, to;             ///< i32 [n, 3 f]
  std::vector<double> shares;  ///< [n]: 1 / faces of an item
};

Ends ends_of(const Tensor& faces, int64_t n) {
  const Tensor host = faces.cpu();
  const int64_t in_a_row = faces.rank() == 2 ? n : n / std::max<int64_t>(faces.size(0), 1);
  const int64_t f = faces.size(-2);
  std::vector<int32_t> from, to;
  std::vector<double> shares;
  const int32_t* const all = host.data<int32_t>();
  for (int64_t i = 0; i < n; ++i) {
    int64_t count = 0;
    for (int64_t k = 0; k < f; ++k) {
      const int32_t* const face = all + 3 * (i / in_a_row * f + k);
      for (const auto& [a, b] : {std::pair(0, 1), {1, 2}, {0, 2}}) {
        from.push_back(face[a]);
        to.push_back(face[b]);
      }
      count += face[0] != face[1] && face[1] != face[2] && face[0] != face[2];
    }
    shares.push_back(1 / static_cast<double>(std::max<int64_t>(count, 1)));
  }
  return {Tensor::from<int32_t>({n, 3 * f}, from).to(faces.device()),
          Tensor::from<int32_t>({n, 3 * f}, to).to(faces.device()), shares};
}

Var lengths(const Var& x, const Ends& ends) {
  return smooth_length(gather(x, ends.from) - gather(x, ends.to), kNothing);
}

/// 1 / length, and 1; both 0 for an edge that has no length.
std::pair<Tensor, Tensor> inverse_and_mask(const Tensor& lengths) {
  const Tensor host = lengths.cpu();
  std::vector<double> inverse, mask;
  for (int64_t i = 0; i < host.numel(); ++i) {
    const double length = host.item(i);
    inverse.push_back(length > 1e-9 ? 1 / length : 0);
    mask.push_back(length > 1e-9 ? 1 : 0);
  }
  const auto back = [&](const std::vector<double>& x) {
    return Tensor::from<double>(lengths.shape(), x).cast(lengths.dtype()).to(lengths.device());
  };
  return {back(inverse), back(mask)};
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
  const Ends ends = ends_of(faces, n);
  const auto [inverse, mask] = inverse_and_mask(lengths(Var(reference), ends).value);
  const Var ratios = lengths(pred, ends) * Var(inverse);
  const Tensor shares =
      Tensor::from<double>({n}, ends.shares).cast(pred.dtype()).to(faces.device());
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
