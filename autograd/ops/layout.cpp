#include "autograd/ops/layout.h"

#include <algorithm>
#include <cstdlib>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/linear.h"

namespace restage {
namespace {

int positive(int axis, int rank) { return axis < 0 ? axis + rank : axis; }

/// Copies or adds along one axis from x (offset ox) to out (offset oo).
void copy_axis(const Tensor& x, Tensor& out, int axis, int64_t ox, int64_t oo, int64_t count,
               bool add = false) {
  const int at = positive(axis, x.rank());
  const int64_t inner = x.shape().product(at + 1, x.rank());
  launch(CopyBlocksArgs{x, out, x.shape().product(0, at), count * inner, x.size(at) * inner,
                        ox * inner, out.size(at) * inner, oo * inner, add});
}

/// Elements [from, from + count) along an axis.
Tensor part_of(const Tensor& x, int axis, int64_t from, int64_t count) {
  Shape shape = x.shape();
  shape.set(axis, count);
  Tensor y = empty_like(x, shape);
  copy_axis(x, y, axis, from, 0, count);
  return y;
}

}  // namespace

void Reshape::check(Inputs x) const {
  int64_t known = 1;
  int open = 0;
  for (int i = 0; i < shape.rank(); ++i) shape[i] == -1 ? open += 1 : known *= shape[i];
  const int64_t n = x[0].numel();
  if (open > 1 || (open == 0 ? n != known : known == 0 ? n != 0 : n % known != 0))
    shape_error(name, letters, x, "the numbers do not fit into " + shape.str());
}

Tensor Reshape::forward(Inputs x, Saved&) const { return x[0].reshape(shape); }

Grads Reshape::backward(const Saved& saved, const Tensor& gy, Needs) const {
  return {gy.reshape(saved.shape(0))};
}

void Permute::check(Inputs x) const {
  std::array<bool, Shape::kMaxRank> seen{};
  bool ok = static_cast<int>(order.size()) == x[0].rank();
  for (const int axis : order) {
    if (axis < 0 || axis >= x[0].rank() || seen[axis]) ok = false;
    if (axis >= 0 && axis < Shape::kMaxRank) seen[axis] = true;
  }
  if (!ok) shape_error(name, letters, x, "order must name every axis once");
  require_floats(name, letters, x);
}

Tensor Permute::forward(Inputs x, Saved&) const {
  Shape shape;
  std::array<int, Shape::kMaxRank> axes{};
  for (size_t i = 0; i < order.size(); ++i) {
    shape.push_back(x[0].size(order[i]));
    axes[i] = order[i];
  }
  Tensor y = empty_like(x[0], shape);
  launch(PermuteArgs{x[0], y, axes});
  return y;
}

Grads Permute::backward(const Saved&, const Tensor& gy, Needs) const {
  Permute inverse{order};
  for (size_t i = 0; i < order.size(); ++i) inverse.order[order[i]] = static_cast<int>(i);
  Saved nothing;
  return {inverse.forward({&gy, 1}, nothing)};
}

void Slice::check(Inputs x) const {
  if (axis >= x[0].rank() || axis < -x[0].rank())
    shape_error(name, letters, x, "no axis " + std::to_string(axis));
  if (from < 0 || to < from || to > x[0].size(axis))
    shape_error(name, letters, x,
                "range " + std::to_string(from) + ".." + std::to_string(to) + " does not fit");
}

Tensor Slice::forward(Inputs x, Saved&) const { return part_of(x[0], axis, from, to - from); }

Grads Slice::backward(const Saved& saved, const Tensor& gy, Needs) const {
  Tensor gx = Tensor::zeros(saved.shape(0), gy.dtype(), gy.device());
  copy_axis(gy, gx, axis, 0, from, to - from);
  return {gx};
}

void Slice::add_to(Tensor& total, const Tensor& gy) const {
  copy_axis(gy, total, axis, 0, from, to - from, true);
}

void Split::check(Inputs x) const {
  if (axis >= x[0].rank() || axis < -x[0].rank())
    shape_error(name, letters, x, "no axis " + std::to_string(axis));
  int64_t left = x[0].size(axis);
  for (const int64_t size : sizes) left = size < 0 || size > left ? -1 : left - size;
  if (left != 0 || sizes.size() == 0) {
    std::string text;
    for (const int64_t size : sizes) text += (text.empty() ? "" : ", ") + std::to_string(size);
    shape_error(name, letters, x, "sizes " + text + " do not fit");
  }
}

Tensors Split::forward(Inputs x, Saved&) const {
  Tensors parts;
  int64_t at = 0;
  for (const int64_t size : sizes) {
    parts.push_back(part_of(x[0], axis, at, size));
    at += size;
  }
  return parts;
}

Grads Split::backward(const Saved& saved, std::span<const Tensor> gy, Needs) const {
  const auto given =
      std::find_if(gy.begin(), gy.end(), [](const Tensor& g) { return g.defined(); });
  Tensor gx = empty_like(*given, saved.shape(0));
  int64_t at = 0;
  for (size_t i = 0; i < sizes.size(); ++i) {
    Shape shape = saved.shape(0);
    shape.set(axis, sizes[i]);
    const Tensor none = gy[i].defined() ? Tensor() : Tensor::zeros(shape, gx.dtype(), gx.device());
    copy_axis(gy[i].defined() ? gy[i] : none, gx, axis, 0, at, sizes[i]);
    at += sizes[i];
  }
  return {gx};
}

void Concat::check(Inputs x) const {
  if (x.empty()) shape_error(name, letters, x, "needs at least one tensor");
  const int at = positive(axis, x[0].rank());
  bool ok = at >= 0 && at < x[0].rank() && x.size() <= 16;
  for (const Tensor& t : x) {
    if (t.rank() != x[0].rank() || t.dtype() != x[0].dtype()) ok = false;
    for (int i = 0; ok && i < t.rank(); ++i)
      if (i != at && t.size(i) != x[0].size(i)) ok = false;
  }
  if (!ok)
    shape_error(name, letters, x, "all axes but axis " + std::to_string(axis) + " must agree");
}

Tensor Concat::forward(Inputs x, Saved&) const {
  Shape shape = x[0].shape();
  int64_t total = 0;
  for (const Tensor& t : x) total += t.size(axis);
  shape.set(axis, total);
  Tensor y = empty_like(x[0], shape);
  int64_t at = 0;
  for (const Tensor& t : x) {
    copy_axis(t, y, axis, 0, at, t.size(axis));
    at += t.size(axis);
  }
  return y;
}

Grads Concat::backward(const Saved& saved, const Tensor& gy, Needs needs) const {
  Grads g(needs.size());
  int64_t at = 0;
  for (size_t i = 0; i < needs.size(); ++i) {
    const int64_t n = saved.shape(i)[axis];
    if (needs[i]) g[i] = part_of(gy, axis, at, n);
    at += n;
  }
  return g;
}

namespace {

void check_index(const char* name, const char* letters, Inputs x, const Tensor& index,
                 int64_t limit) {
  if (x[0].rank() != 3 || index.rank() < 2 || index.size(0) != x[0].size(0) ||
      index.dtype() != DType::i32)
    shape_error(name, letters, x, "needs x[n, v, c] and int32 index " + index.shape().str());
  require_one_device(std::array{x[0], index});
  if (index.device() == Device{} && !index_within(index, limit))
    shape_error(name, letters, x, "an index is outside [0, v)");
  require_floats(name, letters, x);
}

}  // namespace

void Gather::check(Inputs x) const {
  check_index(name, letters, x, index, x[0].rank() == 3 ? x[0].size(1) : 0);
}

Tensor Gather::forward(Inputs x, Saved& saved) const {
  Shape shape = index.shape();
  shape.push_back(x[0].size(2));
  Tensor y = empty_like(x[0], shape);
  const Tensor flat = index.reshape({index.size(0), -1});
  launch(GatherArgs{x[0], flat, y});
  saved.keep({flat});
  return y;
}

Grads Gather::backward(const Saved& saved, const Tensor& gy, Needs) const {
  Tensor gx = empty_like(gy, saved.shape(0));
  launch(ScatterAddArgs{gy, saved[0], gx});
  return {gx};
}

void ScatterAdd::check(Inputs x) const {
  if (rows < 0) shape_error(name, letters, x, "the number of rows is negative");
  check_index(name, letters, x, index, rows);
  if (index.rank() != 2 || index.size(1) != x[0].size(1))
    shape_error(name, letters, x, "one index per row is needed, not " + index.shape().str());
}

Tensor ScatterAdd::forward(Inputs x, Saved& saved) const {
  Tensor y = empty_like(x[0], {x[0].size(0), rows, x[0].size(2)});
  launch(ScatterAddArgs{x[0], index, y});
  saved.keep({index});
  return y;
}

Grads ScatterAdd::backward(const Saved& saved, const Tensor& gy, Needs) const {
  Tensor gx = empty_like(gy, saved.shape(0));
  launch(GatherArgs{gy, saved[0], gx});
  return {gx};
}

void Unfold::check(Inputs x) const {
  if (x[0].rank() != 3) shape_error(name, letters, x, "needs three axes");
  require_floats(name, letters, x);
  if (k < 1 || stride < 1 || steps < 0)
    shape_error(name, letters, x, "kernel and stride must be positive");
  constexpr int64_t kMost = 1 << 20;
  if (k > kMost || stride > kMost || std::abs(pad_left) > kMost || steps > kMost * kMost)
    shape_error(name, letters, x, "kernel, stride and pad_left are at most 2^20");
}

Tensor Unfold::forward(Inputs x, Saved&) const {
  Tensor y = empty_like(x[0], {x[0].size(0), steps, x[0].size(2) * k});
  launch(UnfoldArgs{x[0], y, k, stride, pad_left});
  return y;
}

Grads Unfold::backward(const Saved& saved, const Tensor& gy, Needs) const {
  Tensor gx = empty_like(gy, saved.shape(0));
  launch(FoldArgs{gy, gx, k, stride, pad_left});
  return {gx};
}

Var conv1d(const Var& x, const Var& weight, const Var& bias, int64_t stride, int64_t pad_left,
           int64_t steps) {
  if (weight.rank() != 3 || bias.rank() != 1 || x.rank() != 3 || weight.size(1) != x.size(2) ||
      weight.size(0) != bias.size(0))
    shape_error("conv1d", "x[n, l, c], W[o, c, k], b[o]",
                std::array{x.value, weight.value, bias.value}, "c and o must agree");
  const int64_t k = weight.size(2);
  const Var windows = call(Unfold{k, stride, pad_left, steps}, {x});
  return linear(windows, reshape(weight, {weight.size(0), weight.size(1) * k}), bias);
}

Var repeat_items(const Var& x, int64_t times) {
  if (times == 1) return x;
  const int64_t n = x.size(0), v = x.size(1), c = x.size(2);
  return reshape(expand(reshape(x, {n, 1, v, c}), {n, times, v, c}), {n * times, v, c});
}

Var concat(std::span<const Var> xs, int axis) {
  if (xs.size() <= kMaxInputs) return call(Concat{axis}, xs);
  std::vector<Var> groups;
  for (size_t i = 0; i < xs.size(); i += kMaxInputs)
    groups.push_back(concat(xs.subspan(i, std::min(kMaxInputs, xs.size() - i)), axis));
  return concat(std::span<const Var>(groups), axis);
}

}  // namespace restage
