#include "nn/losses/transfer.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "autograd/kernels/layout.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"
#include "nn/models/lart.h"

namespace restage {
namespace {

constexpr double kNothing = 1e-24;  // square metres: below any distance, above float32's least

/// The lengths of the three edges of every face of `places` [n, 3 f], vertices of x [n, v, 3]:
/// [n, 3 f].
Var edge_lengths(const Var& x, const Tensor& places) {
  const int64_t n = places.size(0), corners = places.size(1);
  const Var from = reshape(gather(x, places), {n, corners / 3, 9});
  const Vars parts = split(from, 2, {3, 6});
  const Var to = concat({parts[1], parts[0]}, 2);
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

/// The faces whose three corners differ. Another face is none: all of its corners become its first,
/// so that none of its edges has a length.
struct Triangles {
  Tensor corners;              ///< as the faces that were given
  std::vector<double> shares;  ///< of each item 1 / how many there are
};

Triangles triangles_of(const Tensor& faces, int64_t n) {
  Triangles out{faces.cpu(), {}};
  const int64_t f = faces.size(-2), m = faces.rank() == 2 ? 1 : faces.size(0);
  std::vector<int64_t> none;  // numbers of faces
  for (int64_t i = 0; i < m; ++i) {
    const int32_t* face = out.corners.data<int32_t>() + i * 3 * f;
    const size_t before = none.size();
    for (int64_t k = 0; k < f; ++k, face += 3)
      if (face[0] == face[1] || face[1] == face[2] || face[0] == face[2]) none.push_back(i * f + k);
    const int64_t count = f - static_cast<int64_t>(none.size() - before);
    out.shares.insert(out.shares.end(), static_cast<size_t>(n / m),
                      1 / static_cast<double>(std::max<int64_t>(count, 1)));
  }
  if (none.empty()) return out;
  out.corners = out.corners.clone();
  for (const int64_t k : none) {
    int32_t* face = out.corners.data<int32_t>() + 3 * k;
    face[1] = face[2] = face[0];
  }
  return out;
}

/// 1 where a length is above a nanometre, else 0, without a look at the host.
Tensor mask_of(const Var& lengths) {
  const Var above = scale(relu(add_scalar(lengths, -1e-9)), 1e15);
  return add_scalar(neg(relu(add_scalar(neg(above), 1))), 1).value;
}

/// Frame number `t` of windows [n, t, v, 3].
Var frame_of(const Var& x, int64_t t) {
  return reshape(slice(x, 1, t, t + 1), {x.size(0), x.size(2), 3});
}

/// i32 [n, up to `most`]: vertices below `all`, in each row the same random ones.
Tensor some_of(int64_t all, int64_t most, int64_t n, const RngKey& key) {
  std::vector<int32_t> order(static_cast<size_t>(all));
  std::iota(order.begin(), order.end(), 0);
  Rng rng(key.fold("vertices"));
  const auto count = static_cast<size_t>(std::min(all, most));
  for (size_t i = 0; i < count; ++i) std::swap(order[i], order[i + rng.below(order.size() - i)]);
  std::vector<int32_t> rows;
  for (int64_t k = 0; k < n; ++k) rows.insert(rows.end(), order.begin(), order.begin() + count);
  return Tensor::from<int32_t>({n, static_cast<int64_t>(count)}, rows);
}

/// LART's: a code between those of the first and the last frame gives a mesh whose distances lie
/// between theirs.
Var mixed_metric(Context& ctx, TransferModel& net, const TransferExamples& e,
                 const TransferWeights& w) {
  auto* lart = dynamic_cast<Lart*>(&net);
  if (lart == nullptr) throw Error("metric loss: the codes of this model cannot be mixed");
  const int64_t last = e.pose.size(1) - 1, v = std::min(w.metric_points, e.identity.size(1));
  const double alpha = w.mixture ? *w.mixture : Rng(ctx.rng.fold("metric")).uniform();
  const Var codes = lart->codes(ctx, e.pose);
  const auto code = [&](int64_t t) { return slice(codes, 1, t, t + 1); };
  const Var mixed =
      frame_of(lart->decode(ctx, code(0) * (1 - alpha) + code(last) * alpha, e.identity), 0);
  // Vertices come in a random order, so the first ones are a random choice.
  const auto some = [&](const Var& x) { return slice(x, 1, 0, v); };
  return metric_loss(some(mixed), some(frame_of(e.truth, 0)).value,
                     some(frame_of(e.truth, last)).value, alpha);
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
  const Triangles triangles = triangles_of(faces, n);
  const Tensor shares =
      Tensor::from<double>({n}, triangles.shares).cast(pred.dtype()).to(pred.value.device());
  const Tensor places = places_of(triangles.corners, n).to(pred.value.device());
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

Var frames_below(const Var& x) { return reshape(x, {x.size(0) * x.size(1), x.size(2), 3}); }

Var transfer_loss(Context& ctx, TransferModel& net, const TransferExamples& e,
                  const TransferWeights& w, const TstDiscriminator* judge, Tensor* made) {
  const Var answer = net.forward(ctx, {e.pose, e.identity});
  *made = answer.value;
  Var total = scale(mse(answer, e.truth), w.reconstruction);
  const Var frames = frames_below(answer);
  const Tensor truth = frames_below(e.truth).value;
  if (w.edge > 0) {
    const Tensor right = w.edge_reference == EdgeReference::truth
                             ? truth
                             : repeat_items(Var(e.identity), e.pose.size(1)).value;
    total = total + scale(mean_all(edge_loss(frames, right, e.faces)), w.edge);
  }
  if (w.distances > 0) {
    const Tensor chosen =
        some_of(frames.size(1), w.metric_points, frames.size(0), ctx.rng).to(frames.value.device());
    const auto some = [&](const Var& x) { return pair_distances(gather(x, chosen)); };
    total = total + scale(mse(some(frames), some(truth)), w.distances);
  }
  if (w.metric > 0) total = total + scale(mixed_metric(ctx, net, e, w), w.metric);
  if (judge != nullptr) {
    const Frozen frozen(ctx);
    total = total + scale(bce_with_logits(judge->logits(ctx, frames), 1), w.adversarial);
  }
  return total;
}

}  // namespace restage
