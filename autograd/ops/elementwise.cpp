#include "autograd/ops/elementwise.h"

#include "autograd/kernels/reduce.h"

namespace restage {
namespace {

Tensor negative(const Tensor& t) {
  Tensor out = empty_like(t);
  launch(UnaryArgs{Unary::neg, t, out});
  return out;
}

}  // namespace

Tensor sum_to(const Tensor& t, const Shape& shape) {
  if (t.shape() == shape) return t;
  Tensor current = t;
  const int lead = t.rank() - shape.rank();
  for (int axis = t.rank() - 1; axis >= 0;) {  // neighbouring summed axes go together
    const auto summed = [&](int i) { return i < lead || (shape[i - lead] == 1 && t.size(i) != 1); };
    if (!summed(axis)) {
      --axis;
      continue;
    }
    int from = axis;
    while (from > 0 && summed(from - 1)) --from;
    Shape next = current.shape();
    for (int i = from; i <= axis; ++i) next.set(i, 1);
    Tensor out = empty_like(t, next);
    launch(SumArgs{current, out, current.shape().product(0, from),
                   current.shape().product(from, axis + 1),
                   current.shape().product(axis + 1, t.rank())});
    current = out;
    axis = from - 1;
  }
  return current.reshape(shape);
}

Tensor binary(Binary op, const Tensor& a, const Tensor& b) {
  bool ok = true;
  Tensor out = empty_like(a, broadcast_shape(a.shape(), b.shape(), &ok));
  if (!ok) shape_error(name_of(op), "a[...], b[...]", std::array{a, b}, "shapes do not broadcast");
  launch(BinaryArgs{op, a, b, out});
  return out;
}

template <Binary B>
void BinaryOp<B>::check(Inputs x) const {
  bool ok = true;
  broadcast_shape(x[0].shape(), x[1].shape(), &ok);
  if (!ok) shape_error(name, letters, x, "shapes do not broadcast");
  require_floats(name, letters, x);
}

template <Binary B>
Tensor BinaryOp<B>::forward(Inputs x, Saved& saved) const {
  if constexpr (B == Binary::mul || B == Binary::div)
    saved.keep(
        {saved.needs(1) ? x[0] : Tensor(), saved.needs(0) || B == Binary::div ? x[1] : Tensor()});
  return binary(B, x[0], x[1]);
}

template <Binary B>
Grads BinaryOp<B>::backward(const Saved& saved, const Tensor& gy, Needs needs) const {
  const Shape &a = saved.shape(0), &b = saved.shape(1);
  Grads g(2);
  if constexpr (B == Binary::add || B == Binary::sub) {
    if (needs[0]) g[0] = sum_to(gy, a);
    if (needs[1]) g[1] = B == Binary::add ? sum_to(gy, b) : negative(sum_to(gy, b));
  } else if constexpr (B == Binary::mul) {
    if (needs[0]) g[0] = sum_to(restage::binary(Binary::mul, gy, saved[1]), a);
    if (needs[1]) g[1] = sum_to(restage::binary(Binary::mul, gy, saved[0]), b);
  } else {
    const Tensor ga = restage::binary(Binary::div, gy, saved[1]);
    if (needs[0]) g[0] = sum_to(ga, a);
    if (needs[1]) {
      const Tensor top = restage::binary(Binary::mul, ga, saved[0]);
      g[1] = sum_to(negative(restage::binary(Binary::div, top, saved[1])), b);
    }
  }
  return g;
}

void Expand::check(Inputs x) const {
  require_floats(name, letters, x);
  bool ok = true;
  if (!(broadcast_shape(x[0].shape(), shape, &ok) == shape) || !ok)
    shape_error(name, letters, x, "cannot be repeated to " + shape.str());
}

Tensor Expand::forward(Inputs x, Saved&) const {
  Tensor y = empty_like(x[0], shape);
  launch(ExpandArgs{x[0], y});
  return y;
}

Grads Expand::backward(const Saved& saved, const Tensor& gy, Needs) const {
  return {sum_to(gy, saved.shape(0))};
}

void Dropout::check(Inputs x) const {
  require_floats(name, letters, x);
  if (p < 0 || p >= 1) shape_error(name, letters, x, "p must be in [0, 1)");
}

Tensor Dropout::forward(Inputs x, Saved& saved) const {
  Tensor y = empty_like(x[0]);
  launch(DropoutArgs{x[0], y, p, key, relu});
  if (relu) saved.keep({y});
  return y;
}

Grads Dropout::backward(const Saved& saved, const Tensor& gy, Needs) const {
  Tensor gx = empty_like(gy);
  if (relu) {
    launch(ReluDropoutGradArgs{saved[0], gy, gx, p});
  } else {
    launch(DropoutArgs{gy, gx, p, key});  // the mask is drawn again, not kept
  }
  return {gx};
}

template struct BinaryOp<Binary::add>;
template struct BinaryOp<Binary::sub>;
template struct BinaryOp<Binary::mul>;
template struct BinaryOp<Binary::div>;

}  // namespace restage
