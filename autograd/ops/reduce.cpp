#include "autograd/ops/reduce.h"

#include "autograd/kernels/reduce.h"

namespace restage {
namespace {

/// A shape seen as [outer, n, inner] around one axis.
struct Around {
  int64_t outer, n, inner;
  Shape without;
  Around(const Shape& s, int axis) : n(s[axis]) {
    const int at = axis < 0 ? axis + s.rank() : axis;
    outer = s.product(0, at);
    inner = s.product(at + 1, s.rank());
    for (int i = 0; i < s.rank(); ++i)
      if (i != at) without.push_back(s[i]);
    if (without.rank() == 0) without.push_back(1);
  }
};

void check_axis(const char* name, const char* letters, Inputs x, int axis, bool not_empty) {
  if (axis >= x[0].rank() || axis < -x[0].rank())
    shape_error(name, letters, x, "there is no axis " + std::to_string(axis));
  if (not_empty && x[0].size(axis) == 0) shape_error(name, letters, x, "the axis is empty");
  require_floats(name, letters, x);
}

}  // namespace

void Sum::check(Inputs x) const { check_axis(name, letters, x, axis, false); }

Tensor Sum::forward(Inputs x, Saved&) const {
  const Around a(x[0].shape(), axis);
  Tensor y = empty_like(x[0], a.without);
  launch(SumArgs{x[0], y, a.outer, a.n, a.inner});
  return y;
}

Grads Sum::backward(const Saved& saved, const Tensor& gy, Needs) const {
  const Around a(saved.shape(0), axis);
  Tensor gx = empty_like(gy, {a.outer, a.n, a.inner});
  launch(ExpandArgs{gy.reshape({a.outer, 1, a.inner}), gx});
  return {gx.reshape(saved.shape(0))};
}

void Max::check(Inputs x) const { check_axis(name, letters, x, axis, true); }

Tensor Max::forward(Inputs x, Saved& saved) const {
  const Around a(x[0].shape(), axis);
  Tensor y = empty_like(x[0], a.without);
  Tensor index = Tensor::empty(a.without, DType::i32, x[0].device());
  launch(MaxArgs{x[0], y, index, a.outer, a.n, a.inner});
  saved.keep({index});
  return y;
}

Grads Max::backward(const Saved& saved, const Tensor& gy, Needs) const {
  const Around a(saved.shape(0), axis);
  Tensor gx = empty_like(gy, saved.shape(0));
  launch(MaxGradArgs{gy, saved[0], gx, a.outer, a.n, a.inner});
  return {gx};
}

void Softmax::check(Inputs x) const { check_axis(name, letters, x, axis, true); }

Tensor Softmax::forward(Inputs x, Saved& saved) const {
  const Around a(x[0].shape(), axis);
  Tensor y = empty_like(x[0]);
  launch(SoftmaxArgs{x[0], y, a.outer, a.n, a.inner});
  saved.keep({y});
  return y;
}

Grads Softmax::backward(const Saved& saved, const Tensor& gy, Needs) const {
  const Around a(gy.shape(), axis);
  Tensor gx = empty_like(gy);
  launch(SoftmaxGradArgs{saved[0], gy, gx, a.outer, a.n, a.inner});
  return {gx};
}

Var mean(const Var& x, int axis) {
  check_axis("mean", Sum::letters, std::array{x.value}, axis, true);
  return scale(sum(x, axis), 1.0 / static_cast<double>(x.size(axis)));
}

Var sum_all(const Var& x) { return sum(x.rank() == 1 ? x : call(Reshape{{-1}}, {x}), 0); }

Var mean_all(const Var& x) {
  if (x.value.numel() == 0) shape_error("mean", "x[...]", std::array{x.value}, "x is empty");
  return scale(sum_all(x), 1.0 / static_cast<double>(x.value.numel()));
}

Var smooth_length(const Var& x, double epsilon) {
  return sqrt(add_scalar(sum(square(x), -1), epsilon));
}

Var mse(const Var& a, const Var& b) {
  if (!(a.shape() == b.shape()) || a.value.numel() == 0)  // broadcasting here is always a mistake
    shape_error("mse", "a[...], b[...]", std::array{a.value, b.value},
                "needs equal shapes that are not empty");
  return mean_all(square(sub(a, b)));
}

Var bce_with_logits(const Var& logits, double label) {
  if (logits.value.numel() == 0)
    shape_error("bce_with_logits", "logits[...]", std::array{logits.value}, "there are none");
  if (label == 0) return mean_all(softplus(logits));
  if (label == 1) return mean_all(softplus(neg(logits)));
  return mean_all(sub(softplus(logits), scale(logits, label)));
}

}  // namespace restage
