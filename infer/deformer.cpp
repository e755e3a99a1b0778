#include "infer/deformer.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "autograd/base/error.h"
#include "autograd/kernels/matmul.h"
#include "autograd/kernels/point_tiles.h"

namespace restage {
namespace {

constexpr int64_t P = kDeformTile;

void require(const Tensor& t, const Shape& shape, const char* what) {
  if (t.shape() == shape && t.dtype() == DType::f32) return;
  throw ShapeError(std::string("deformer: ") + what + " must be float32 " + shape.str() + ", not " +
                   name_of(t.dtype()) + " " + t.shape().str());
}

/// `rows` [v, c], one row a point, rearranged as [t, c, P]: tile, column, place of the point in its
/// tile. `order` [t, P] says which point has which place.
Tensor in_tiles(const Tensor& rows, const Tensor& order) {
  const int64_t t = order.size(0), c = rows.size(1);
  Tensor out = Tensor::empty({t, c, P});
  for (int64_t i = 0; i < t * P; ++i) {
    const float* row = rows.data<float>() + c * order.data<int32_t>()[i];
    for (int64_t k = 0; k < c; ++k) out.data<float>()[(i / P * c + k) * P + i % P] = row[k];
  }
  return out;
}

/// Columns [from, to) of `a` [m, n], as [m, width], or transposed as [to - from, width]. Rows that
/// are shorter than `width` are filled up with zeros.
Tensor columns(const Tensor& a, int64_t from, int64_t to, bool transpose, int64_t width) {
  const int64_t m = a.size(0), n = a.size(1), k = to - from;
  Tensor out = Tensor::zeros({transpose ? k : m, width});
  for (int64_t i = 0; i < m; ++i)
    for (int64_t j = 0; j < k; ++j)
      out.data<float>()[transpose ? j * width + i : i * width + j] =
          a.data<float>()[i * n + from + j];
  return out;
}

/// The least (`sign` 1) or the largest (`sign` -1) value of w1 x over the points x of each tile,
/// for each unit: [t, u].
Tensor bound(const Tensor& points, const Tensor& w1, float sign) {
  const int64_t t = points.size(0), u = w1.size(0);
  Tensor out = Tensor::empty({t, u});
  for (int64_t i = 0; i < t; ++i) {
    const float* x = points.data<float>() + i * 3 * P;
    for (int64_t k = 0; k < u; ++k) {
      const float* w = w1.data<float>() + 3 * k;
      float least = INFINITY;
      for (int64_t p = 0; p < P; ++p)
        least = std::min(least, sign * (w[0] * x[p] + w[1] * x[P + p] + w[2] * x[2 * P + p]));
      out.data<float>()[i * u + k] = sign * least;
    }
  }
  return out;
}

}  // namespace

Deformer::Deformer(const Tensor& points, const Tensor& weights, const Mlp3* offsets, Device device)
    : count_(points.size(0)), device_(device), with_offsets_(offsets != nullptr) {
  require(points, {count_, 3}, "points");
  require(weights, {count_, weights.size(-1)}, "weights");
  const int64_t t = (count_ + P - 1) / P;
  order_ = Tensor::empty({t, P}, DType::i32);
  int32_t* order = order_.data<int32_t>();
  std::iota(order, order + count_, 0);
  sort_into_tiles(points.data<float>(), order, order + count_, P, kDeformGroup);
  // The last tile is filled up with copies of the last point. The copies are computed too and give
  // the same bits as that point.
  std::fill(order + count_, order + t * P, count_ > 0 ? order[count_ - 1] : 0);
  points_ = in_tiles(points, order_);
  weights_ = in_tiles(weights, order_);
  if (with_offsets_) take_offsets(*offsets);
  for (Tensor* own : {&points_, &weights_, &order_, &pose_weights_, &bias1_, &field_.w1, &field_.w2,
                      &field_.b2, &field_.w3, &field_.b3, &field_.low, &field_.high})
    if (own->defined()) *own = own->to(device_);
}

void Deformer::take_offsets(const Mlp3& net) {
  const Tensor &w1 = net.fc1.weight.value, &w2 = net.fc2.weight.value, &w3 = net.fc3.weight.value;
  const int64_t u = w1.size(0), c = w1.size(1) - 3;
  const int64_t p = (u + kDeformAlign - 1) / kDeformAlign * kDeformAlign;
  require(w1, {u, c + 3}, "fc1");
  require(w3, {3, u}, "fc3");
  pose_weights_ = columns(w1, 0, c, false, c);
  bias1_ = net.fc1.bias.value;
  field_.w1 = columns(w1, c, c + 3, false, 3);
  field_.w2 = columns(w2, 0, u, true, p);
  field_.b2 = columns(net.fc2.bias.value.reshape({1, u}), 0, u, false, p);
  field_.w3 = columns(w3, 0, u, false, p);
  field_.b3 = net.fc3.bias.value;
  field_.low = bound(points_, field_.w1, 1);
  field_.high = bound(points_, field_.w1, -1);
}

Tensor Deformer::operator()(const Tensor& pose, const Tensor& bones, bool dense) const {
  return run(pose, bones, dense, nullptr);
}

double Deformer::active_share(const Tensor& pose) const {
  const int64_t t = order_.size(0);
  if (!with_offsets_ || t == 0) return 0;
  Tensor active = Tensor::empty({t}, DType::i32, device_);
  run(pose, Tensor::zeros({weights_.size(1), 3, 4}), false, &active);
  active = active.cpu();
  double total = 0;
  for (int64_t i = 0; i < t; ++i) total += active.item(i);
  return total / static_cast<double>(t * field_.w1.size(0));
}

Tensor Deformer::run(const Tensor& pose, const Tensor& bones, bool dense, Tensor* active) const {
  require(bones, {weights_.size(1), 3, 4}, "bones");
  const Tensor there = bones.to(device_);
  Tensor out = Tensor::empty({count_, 3}, DType::f32, device_);
  if (!with_offsets_) {
    launch(DeformArgs{points_, weights_, order_, there, nullptr, out});
    return out.cpu();
  }
  require(pose, {1, pose_weights_.size(1)}, "pose");
  OffsetField field = field_;
  Tensor b1 = Tensor::empty({1, bias1_.size(0)}, DType::f32, device_);
  launch(MatmulArgs{pose.to(device_), pose_weights_, b1, false, true, &bias1_});
  field.b1 = b1;
  launch(DeformArgs{points_, weights_, order_, there, &field, out, active, dense});
  return out.cpu();
}

}  // namespace restage
