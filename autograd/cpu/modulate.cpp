#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "autograd/cpu/modulate.cpp"
#include <hwy/foreach_target.h>  // once per instruction set

#include <algorithm>
#include <array>

#include "autograd/cpu/common.h"
#include "autograd/cpu/kernels.h"
#include "autograd/cpu/math-inl.h"
#include "autograd/cpu/targets.h"
#include "autograd/kernels/scratch.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {
namespace {

constexpr int64_t kRows = 128;  // of one item: a part, whose sums are in T
constexpr size_t kSums = 8;     // of a channel: A's three, a, B's three, b

/// The parameters with their channels side by side: A's three columns, a, B's three, b.
template <class T>
Scratch<T> by_channel(const Tensor& scale, const Tensor& scale_bias, const Tensor& shift,
                      const Tensor& shift_bias, int64_t c) {
  Scratch<T> out(kSums * static_cast<size_t>(c));
  T* to = out.data();
  for (const auto& [weight, bias] : {std::pair{&scale, &scale_bias}, {&shift, &shift_bias}}) {
    for (int64_t k = 0; k < 3; ++k)
      for (int64_t i = 0; i < c; ++i) *to++ = weight->template data<T>()[3 * i + k];
    to = std::copy_n(bias->template data<T>(), c, to);
  }
  return out;
}

/// Calls f(tag, channel) for vectors of channels, and one by one for what is left.
template <class T, class F>
HWY_INLINE void for_channels(int64_t c, const F& f) {
  const hn::ScalableTag<T> many;
  const hn::CappedTag<T, 1> one;
  const auto lanes = static_cast<int64_t>(hn::Lanes(many));
  int64_t i = 0;
  for (; i + lanes <= c; i += lanes) f(many, i);
  for (; i < c; ++i) f(one, i);
}

/// Rows of one part of an item. `x_step`: from a row of x to the next, 0 if there is one only.
template <class T>
struct Part {
  const T *x, *mesh;
  int64_t rows, c, x_step;
};

template <class T>
Part<T> part_of(const Tensor& x, const Tensor& mesh, int64_t item, int64_t from) {
  const int64_t v = mesh.size(1), c = x.size(2), x_step = x.size(1) == v ? c : 0;
  return {x.data<T>() + item * x.size(1) * c + from * x_step,
          mesh.data<T>() + (item * v + from) * 3, std::min(kRows, v - from), c, x_step};
}

/// Factor and shift at a point: p holds a channel's parameters.
template <class V, class T>
HWY_INLINE V affine_at(const V* p, const T* m) {
  const hn::DFromV<V> d;
  V out = hn::MulAdd(p[0], hn::Set(d, m[0]), p[3]);
  out = hn::MulAdd(p[1], hn::Set(d, m[1]), out);
  return hn::MulAdd(p[2], hn::Set(d, m[2]), out);
}

template <class T>
void forward_part(const Part<T>& part, const T* parameters, bool relu, T* out) {
  for_channels<T>(part.c, [&](auto d, int64_t i) HWY_ATTR {
    using V = hn::Vec<decltype(d)>;
    V p[kSums];
    for (size_t k = 0; k < kSums; ++k)
      p[k] = hn::LoadU(d, parameters + static_cast<int64_t>(k) * part.c + i);
    for (int64_t r = 0; r < part.rows; ++r) {
      const T* m = part.mesh + 3 * r;
      const V x = hn::LoadU(d, part.x + r * part.x_step + i);
      const V y = hn::MulAdd(affine_at(p, m), x, affine_at(p + 4, m));
      hn::StoreU(relu ? hn::IfThenZeroElse(hn::Le(y, hn::Zero(d)), y) : y, d, out + r * part.c + i);
    }
  });
}

/// gx of the part's rows, or their sum where x has one row; `sums` [8, c].
template <class T>
void backward_part(const Part<T>& part, const T* parameters, bool relu, const T* gy, T* gx,
                   T* sums) {
  for_channels<T>(part.c, [&](auto d, int64_t i) HWY_ATTR {
    using V = hn::Vec<decltype(d)>;
    const V zero = hn::Zero(d);
    V p[kSums], s[kSums], all = zero;
    for (size_t k = 0; k < kSums; ++k) {
      p[k] = hn::LoadU(d, parameters + static_cast<int64_t>(k) * part.c + i);
      s[k] = zero;
    }
    for (int64_t r = 0; r < part.rows; ++r) {
      const T* m = part.mesh + 3 * r;
      const V x = hn::LoadU(d, part.x + r * part.x_step + i), factor = affine_at(p, m);
      V g = hn::LoadU(d, gy + r * part.c + i);
      if (relu) g = hn::IfThenZeroElse(hn::Le(hn::MulAdd(factor, x, affine_at(p + 4, m)), zero), g);
      const V to_x = hn::Mul(g, factor), gm = hn::Mul(g, x);
      if (part.x_step > 0) {
        hn::StoreU(to_x, d, gx + r * part.c + i);
      } else {
        all = hn::Add(all, to_x);
      }
      for (size_t k = 0; k < 3; ++k) {
        s[k] = hn::MulAdd(gm, hn::Set(d, m[k]), s[k]);
        s[4 + k] = hn::MulAdd(g, hn::Set(d, m[k]), s[4 + k]);
      }
      s[3] = hn::Add(s[3], gm);
      s[7] = hn::Add(s[7], g);
    }
    if (part.x_step == 0) hn::StoreU(all, d, gx + i);
    for (size_t k = 0; k < kSums; ++k)
      hn::StoreU(s[k], d, sums + static_cast<int64_t>(k) * part.c + i);
  });
}

/// The gradient of the coordinates: at each point a sum over its channels.
template <class T>
void mesh_grad_part(const Part<T>& part, const T* parameters, bool relu, const T* gy, T* g_mesh) {
  const T* p = parameters;
  const int64_t c = part.c;
  for (int64_t r = 0; r < part.rows; ++r) {
    const T *x = part.x + r * part.x_step, *m = part.mesh + 3 * r;
    for (int64_t k = 0; k < 3; ++k) {
      T sum = 0;
      for (int64_t i = 0; i < c; ++i) {
        const auto at = [&](const T* q) {
          return q[i] * m[0] + q[c + i] * m[1] + q[2 * c + i] * m[2] + q[3 * c + i];
        };
        if (relu && !(at(p) * x[i] + at(p + 4 * c) > 0)) continue;
        sum += gy[r * c + i] * (x[i] * p[k * c + i] + p[(4 + k) * c + i]);
      }
      g_mesh[3 * r + k] = sum;
    }
  }
}

template <class T>
void modulate_of(const ModulateArgs& a) {
  const int64_t n = a.x.size(0), v = a.mesh.size(1), c = a.x.size(2);
  const int64_t parts = (v + kRows - 1) / kRows;
  const auto parameters = by_channel<T>(a.scale, a.scale_bias, a.shift, a.shift_bias, c);
  parallel_for(n * parts, row_grain(kRows * c), [&](int64_t from, int64_t to) HWY_ATTR {
    for (int64_t k = from; k < to; ++k) {
      const int64_t item = k / parts, first = k % parts * kRows;
      forward_part(part_of<T>(a.x, a.mesh, item, first), parameters.data(),
                   a.activation == Activation::relu, a.out.data<T>() + (item * v + first) * c);
    }
  });
}

/// to[i] = the sum of from[part * step + i] over `parts`, in order, for i < c.
template <class T, class To>
void add_parts(const T* from, int64_t parts, int64_t step, int64_t c, const To& to) {
  constexpr int64_t kColumns = 64;
  parallel_for(c, kColumns, [&](int64_t first, int64_t last) HWY_ATTR {
    double sums[kColumns] = {};
    for (int64_t p = 0; p < parts; ++p)
      for (int64_t i = first; i < last; ++i)
        sums[i - first] += static_cast<double>(from[p * step + i]);
    for (int64_t i = first; i < last; ++i) *to(i) = static_cast<T>(sums[i - first]);
  });
}

/// Of all parts into the parameters' gradients, of an item's into the gradient of its one row.
template <class T>
void add_up(const ModulateGradArgs& a, int64_t parts, const T* sums, const T* rows) {
  const int64_t n = a.x.size(0), c = a.x.size(2);
  Tensor* const gradients[] = {&a.g_scale, &a.g_scale_bias, &a.g_shift, &a.g_shift_bias};
  const auto width = static_cast<int64_t>(kSums) * c;
  add_parts(sums, n * parts, width, width, [&](int64_t at) {
    const int64_t k = at / c, i = at % c;
    T* to = gradients[k / 4 * 2 + (k % 4 == 3)]->template data<T>();
    return k % 4 == 3 ? to + i : to + 3 * i + k % 4;
  });
  if (a.x.size(1) == a.mesh.size(1)) return;
  for (int64_t item = 0; item < n; ++item)
    add_parts(rows + item * parts * c, parts, c, c,
              [&](int64_t i) { return a.out.data<T>() + item * c + i; });
}

template <class T>
void modulate_grad_of(const ModulateGradArgs& a) {
  const int64_t n = a.x.size(0), v = a.mesh.size(1), c = a.x.size(2);
  const int64_t parts = (v + kRows - 1) / kRows;
  const bool relu = a.activation == Activation::relu, one = a.x.size(1) != v;
  const auto parameters = by_channel<T>(a.scale, a.scale_bias, a.shift, a.shift_bias, c);
  Scratch<T> sums(static_cast<size_t>(n * parts * c) * kSums),
      rows(one ? static_cast<size_t>(n * parts * c) : 0);
  T *to_sums = sums.data(), *to_rows = rows.data();
  parallel_for(n * parts, row_grain(kRows * c), [&](int64_t from, int64_t to) HWY_ATTR {
    for (int64_t k = from; k < to; ++k) {
      const int64_t item = k / parts, first = k % parts * kRows, at = (item * v + first) * c;
      const Part<T> part = part_of<T>(a.x, a.mesh, item, first);
      const T* gy = a.gy.data<T>() + at;
      backward_part(part, parameters.data(), relu, gy, one ? to_rows + k * c : a.out.data<T>() + at,
                    to_sums + k * static_cast<int64_t>(kSums) * c);
      if (a.g_mesh != nullptr)
        mesh_grad_part(part, parameters.data(), relu, gy,
                       a.g_mesh->data<T>() + (item * v + first) * 3);
    }
  });
  add_up(a, parts, to_sums, to_rows);
}

/// What ElaIN makes before its activation, of a part that both want.
template <class V>
struct Mixed {
  V asked, out;
  HWY_INLINE Mixed(V x, V unit, V gamma, V beta, V share)
      : asked(hn::MulAdd(gamma, unit, beta)),
        out(hn::MulAdd(share, asked, hn::NegMulAdd(share, x, hn::Add(unit, x)))) {}
};

template <class T>
void elain_of(const ElainArgs& a) {
  const int64_t v = a.x.size(1), c = a.x.size(2);
  const auto slope = static_cast<T>(a.slope);
  const auto mix = [slope](auto x, auto unit, auto gamma, auto beta, auto share) HWY_ATTR {
    const hn::DFromV<decltype(x)> d;
    const auto y = Mixed(x, unit, gamma, beta, share).out;
    return hn::IfThenElse(hn::Gt(y, hn::Zero(d)), y, hn::Mul(y, hn::Set(d, slope)));
  };
  parallel_for(a.x.size(0) * v, row_grain(c), [&](int64_t from, int64_t to) HWY_ATTR {
    for (int64_t r = from; r < to; ++r)
      map(c, a.out.data<T>() + r * c, mix, a.x.data<T>() + r * c, a.unit.data<T>() + r * c,
          a.gamma.data<T>() + r * c, a.beta.data<T>() + r * c, a.share.data<T>() + r / v * c);
  });
}

/// Rows [first, first + rows) of all points; `share` [c] is their item's, `sums` [c] the part's sum
/// of the gradient of it.
template <class T>
void elain_grad_part(const ElainGradArgs& a, int64_t first, int64_t rows, const T* share, T* sums) {
  const int64_t c = a.x.size(2);
  for_channels<T>(c, [&](auto d, int64_t i) HWY_ATTR {
    const auto s = hn::LoadU(d, share + i), zero = hn::Zero(d);
    const auto slope = hn::Set(d, static_cast<T>(a.slope));
    auto sum = zero;
    for (int64_t at = first * c + i; at < (first + rows) * c; at += c) {
      const auto load = [&](const Tensor& t) HWY_ATTR { return hn::LoadU(d, t.data<T>() + at); };
      const auto x = load(a.x), unit = load(a.unit), gamma = load(a.gamma), gy = load(a.gy);
      const Mixed mixed(x, unit, gamma, load(a.beta), s);
      const auto g = hn::IfThenElse(hn::Gt(mixed.out, zero), gy, hn::Mul(gy, slope));
      const auto of_asked = hn::Mul(g, s);
      hn::StoreU(hn::Sub(g, of_asked), d, a.out.data<T>() + at);
      hn::StoreU(hn::MulAdd(of_asked, gamma, g), d, a.g_unit.data<T>() + at);
      hn::StoreU(hn::Mul(of_asked, unit), d, a.g_gamma.data<T>() + at);
      hn::StoreU(of_asked, d, a.g_beta.data<T>() + at);
      sum = hn::MulAdd(g, hn::Sub(mixed.asked, x), sum);
    }
    hn::StoreU(sum, d, sums + i);
  });
}

template <class T>
void elain_grad_of(const ElainGradArgs& a) {
  const int64_t n = a.x.size(0), v = a.x.size(1), c = a.x.size(2);
  const int64_t parts = (v + kRows - 1) / kRows;
  Scratch<T> sums(static_cast<size_t>(n * parts * c));
  T* of_parts = sums.data();
  parallel_for(n * parts, row_grain(kRows * c), [&](int64_t from, int64_t to) HWY_ATTR {
    for (int64_t k = from; k < to; ++k) {
      const int64_t item = k / parts, first = k % parts * kRows;
      elain_grad_part(a, item * v + first, std::min(kRows, v - first), a.share.data<T>() + item * c,
                      of_parts + k * c);
    }
  });
  for (int64_t item = 0; item < n; ++item)
    add_parts(of_parts + item * parts * c, parts, c, c,
              [&](int64_t i) { return a.g_share.data<T>() + item * c + i; });
}

}  // namespace

void modulate(const ModulateArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR { modulate_of<decltype(zero)>(args); });
}

void modulate_grad(const ModulateGradArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR { modulate_grad_of<decltype(zero)>(args); });
}

void elain(const ElainArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR { elain_of<decltype(zero)>(args); });
}

void elain_grad(const ElainGradArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR { elain_grad_of<decltype(zero)>(args); });
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace restage::cpu {
RESTAGE_KERNEL(modulate, ModulateArgs)
RESTAGE_KERNEL(modulate_grad, ModulateGradArgs)
RESTAGE_KERNEL(elain, ElainArgs)
RESTAGE_KERNEL(elain_grad, ElainGradArgs)
}  // namespace restage::cpu
#endif
