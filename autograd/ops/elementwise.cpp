#include "autograd/ops/elementwise.h"

#include "autograd/kernels/reduce.h"

namespace restage {
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

namespace {

/// Whether the gradient of number `input` is computed from number `from`, too.
constexpr bool reads(Binary op, int input, int from) {
  const Partial of = partial(op, input);
  return of == Partial::of_both || of == (from == 0 ? Partial::of_first : Partial::of_second);
}

}  // namespace

template <Binary B>
Tensor BinaryOp<B>::forward(Inputs x, Saved& saved) const {
  const auto kept = [&](int from) {
    for (const int input : {0, 1})
      if (reads(B, input, from) && saved.needs(static_cast<size_t>(input)))
        return x[static_cast<size_t>(from)];
    return Tensor();
  };
  if constexpr (reads(B, 0, 0) || reads(B, 0, 1) || reads(B, 1, 0) || reads(B, 1, 1))
    saved.keep({kept(0), kept(1)});
  return binary(B, x[0], x[1]);
}

template <Binary B>
Grads BinaryOp<B>::backward(const Saved& saved, const Tensor& gy, Needs needs) const {
  Grads g(2);
  for (const int input : {0, 1}) {
    const auto i = static_cast<size_t>(input);
    if (!needs[i]) continue;
    const Partial of = partial(B, input);
    // What is of gy alone is summed first: it is proportional to gy.
    const bool first = of == Partial::is_g || of == Partial::of_g;
    g[i] = first ? sum_to(gy, saved.shape(i)) : gy;
    if (of == Partial::is_g) continue;
    Tensor out = empty_like(g[i]);
    launch(BinaryGradArgs{B, input, reads(B, input, 0) ? &saved[0] : nullptr,
                          reads(B, input, 1) ? &saved[1] : nullptr, g[i], out});
    g[i] = first ? out : sum_to(out, saved.shape(i));
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

#define RESTAGE_INSTANTIATE(name, ...) template struct BinaryOp<Binary::name>;
RESTAGE_BINARY(RESTAGE_INSTANTIATE)
#undef RESTAGE_INSTANTIATE

}  // namespace restage
