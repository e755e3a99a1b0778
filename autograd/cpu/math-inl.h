// Elementary functions on vectors, and loops over arrays with them. Each lane by itself, so results
// do not depend on the width of a vector. NaN stays NaN; overflow is infinity.
#if defined(RESTAGE_CPU_MATH_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef RESTAGE_CPU_MATH_INL_H
#undef RESTAGE_CPU_MATH_INL_H
#else
#define RESTAGE_CPU_MATH_INL_H
#endif

#include <hwy/contrib/math/math-inl.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "autograd/cpu/targets.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <class V>
using Lane = hn::TFromV<V>;

template <class V>
HWY_INLINE V keep_nan(V x, V y) {
  return hn::IfThenElse(hn::Eq(x, x), y, x);
}

/// x between -limit and limit, 0 for NaN: Highway's functions turn it into a whole number, which
/// not every number of the baseline can become.
template <class V>
HWY_INLINE V within(V x, Lane<V> limit) {
  const V top = hn::Set(hn::DFromV<V>(), limit);
  return hn::Max(hn::Min(hn::IfThenElseZero(hn::Eq(x, x), x), top), hn::Neg(top));
}

/// exp(x) within 2 units in the last place; below 1.7e-38 (x < -87) zero. (Highway's own gives the
/// subnormal numbers too, and takes twice as long.)
template <class V>
HWY_INLINE V exp_of_float(V x) {
  const hn::DFromV<V> d;
  const hn::RebindToSigned<decltype(d)> di;
  const auto number = [&](float c) HWY_ATTR { return hn::Set(d, c); };
  // x = n ln 2 + r; adding 1.5 * 2^23 leaves the nearest whole number in the lowest bits.
  const V magic = number(12582912.0f);
  const V shifted = hn::MulAdd(x, number(1.44269504f), magic), n = hn::Sub(shifted, magic);
  V r = hn::NegMulAdd(n, number(0.693359375f), x);
  r = hn::NegMulAdd(n, number(-2.12194440e-4f), r);
  V p = number(1.9875691500e-4f);  // exp(r) = 1 + r + r^2 p(r): Cephes' minimax polynomial
  p = hn::MulAdd(p, r, number(1.3981999507e-3f));
  p = hn::MulAdd(p, r, number(8.3334519073e-3f));
  p = hn::MulAdd(p, r, number(4.1665795894e-2f));
  p = hn::MulAdd(p, r, number(1.6666665459e-1f));
  p = hn::MulAdd(p, r, number(5.0000001201e-1f));
  const V y = hn::Add(hn::MulAdd(hn::Mul(r, r), p, r), number(1.0f));
  // Times 2^(n - 1) and then 2: 2^128 is no number.
  const auto exponent = hn::Add(hn::BitCast(di, shifted), hn::Set(di, 126 - 0x4b400000));
  const V half = hn::Mul(y, hn::BitCast(d, hn::ShiftLeft<23>(exponent)));
  const V small = hn::IfThenZeroElse(hn::Lt(x, number(-87.0f)), hn::Add(half, half));
  const V infinity = number(std::numeric_limits<float>::infinity());
  return hn::IfThenElse(hn::Gt(x, number(88.7228317f)), infinity, small);
}

template <class V>
HWY_INLINE V exp(V x) {
  using T = Lane<V>;
  if constexpr (sizeof(T) == sizeof(float)) return exp_of_float(x);
  const hn::DFromV<V> d;
  const V limit = hn::Set(d, std::log(std::numeric_limits<T>::max()));
  const V infinity = hn::Set(d, std::numeric_limits<T>::infinity());
  const V y = hn::Exp(d, within(x, T(1000)));
  return keep_nan(x, hn::IfThenElse(hn::Gt(x, limit), infinity, y));
}

/// 1 - 2 / (exp(2 |x|) + 1), and near zero Cephes' polynomial.
template <class V>
HWY_INLINE V tanh_of_float(V x) {
  const hn::DFromV<V> d;
  const auto number = [&](float c) HWY_ATTR { return hn::Set(d, c); };
  const V size = hn::Abs(x), one = number(1.0f), square = hn::Mul(x, x);
  const V grown = exp_of_float(hn::Add(size, size));
  const V large = hn::Sub(one, hn::Div(number(2.0f), hn::Add(grown, one)));
  V p = number(-5.70498872745e-3f);
  p = hn::MulAdd(p, square, number(2.06390887954e-2f));
  p = hn::MulAdd(p, square, number(-5.37397155531e-2f));
  p = hn::MulAdd(p, square, number(1.33314422036e-1f));
  p = hn::MulAdd(p, square, number(-3.33332819422e-1f));
  const V small = hn::MulAdd(hn::Mul(p, square), x, x);
  return hn::IfThenElse(hn::Lt(size, number(0.625f)), small, hn::CopySign(large, x));
}

template <class V>
HWY_INLINE V tanh(V x) {
  if constexpr (sizeof(Lane<V>) == sizeof(float)) return tanh_of_float(x);
  return keep_nan(x, hn::Tanh(hn::DFromV<V>(), within(x, Lane<V>(20))));  // tanh(20) is 1
}

template <class V>
HWY_INLINE V sigmoid(V x) {
  const V one = hn::Set(hn::DFromV<V>(), Lane<V>(1));
  return hn::Div(one, hn::Add(one, exp(hn::Neg(x))));
}

/// log(0) is -infinity, log of a negative number NaN.
template <class V>
HWY_INLINE V log(V x) {
  const hn::DFromV<V> d;
  using T = Lane<V>;
  const V zero = hn::Zero(d), infinity = hn::Set(d, std::numeric_limits<T>::infinity());
  const V nan = hn::Set(d, std::numeric_limits<T>::quiet_NaN());
  V y = hn::IfThenElse(hn::Lt(x, infinity), hn::Log(d, x), x);  // infinity and NaN stay
  y = hn::IfThenElse(hn::Eq(x, zero), hn::Neg(infinity), y);
  return hn::IfThenElse(hn::Lt(x, zero), nan, y);
}

/// log(1 + exp(x)) without overflow.
template <class V>
HWY_INLINE V softplus(V x) {
  const hn::DFromV<V> d;
  const V tail = hn::Log1p(d, exp(hn::Neg(hn::Abs(x))));
  return keep_nan(x, hn::Add(hn::IfThenElseZero(hn::Gt(x, hn::Zero(d)), x), tail));
}

/// A vector that formulas can be written with (kernels/unary_rows.h). Each operator is one
/// instruction; fma() is two where the processor has none.
template <class T>
struct Numbers {
  using Tag = hn::ScalableTag<T>;
  using Vector = hn::Vec<Tag>;
  using Mask = hn::Mask<Tag>;
  Vector v;
  HWY_INLINE explicit Numbers(Vector vector) : v(vector) {}
  HWY_INLINE explicit Numbers(T number) : v(hn::Set(Tag(), number)) {}
  friend HWY_INLINE Numbers operator-(Numbers a) { return Numbers(hn::Neg(a.v)); }
  friend HWY_INLINE Numbers operator+(Numbers a, Numbers b) { return Numbers(hn::Add(a.v, b.v)); }
  friend HWY_INLINE Numbers operator-(Numbers a, Numbers b) { return Numbers(hn::Sub(a.v, b.v)); }
  friend HWY_INLINE Numbers operator*(Numbers a, Numbers b) { return Numbers(hn::Mul(a.v, b.v)); }
  friend HWY_INLINE Numbers operator/(Numbers a, Numbers b) { return Numbers(hn::Div(a.v, b.v)); }
  friend HWY_INLINE Mask operator<(Numbers a, Numbers b) { return hn::Lt(a.v, b.v); }
  friend HWY_INLINE Mask operator>(Numbers a, Numbers b) { return hn::Gt(a.v, b.v); }
  friend HWY_INLINE Mask operator<=(Numbers a, Numbers b) { return hn::Le(a.v, b.v); }
  friend HWY_INLINE Mask operator>=(Numbers a, Numbers b) { return hn::Ge(a.v, b.v); }
  friend HWY_INLINE Numbers where(Mask m, Numbers a, Numbers b) {
    return Numbers(hn::IfThenElse(m, a.v, b.v));
  }
  friend HWY_INLINE Numbers fma(Numbers a, Numbers b, Numbers c) {
    return Numbers(hn::MulAdd(a.v, b.v, c.v));
  }
  friend HWY_INLINE Numbers abs(Numbers a) { return Numbers(hn::Abs(a.v)); }
  friend HWY_INLINE Numbers sqrt(Numbers a) { return Numbers(hn::Sqrt(a.v)); }
  friend HWY_INLINE Numbers exp(Numbers a) { return Numbers(HWY_NAMESPACE::exp(a.v)); }
  friend HWY_INLINE Numbers log(Numbers a) { return Numbers(HWY_NAMESPACE::log(a.v)); }
  friend HWY_INLINE Numbers tanh(Numbers a) { return Numbers(HWY_NAMESPACE::tanh(a.v)); }
  friend HWY_INLINE Numbers sigmoid(Numbers a) { return Numbers(HWY_NAMESPACE::sigmoid(a.v)); }
  friend HWY_INLINE Numbers softplus(Numbers a) { return Numbers(HWY_NAMESPACE::softplus(a.v)); }
};

/// out[i] = f(in[i]...) for i < n, whole vectors at a time; the rest in one padded vector, so every
/// element is computed by the same instructions. out may be one of the inputs.
template <class T, class F, class... In>
HWY_INLINE void map(int64_t n, T* out, F f, const In*... in) {
  const hn::ScalableTag<T> d;
  const auto lanes = static_cast<int64_t>(hn::Lanes(d));
  int64_t i = 0;
  for (; i + lanes <= n; i += lanes) hn::StoreU(f(hn::LoadU(d, in + i)...), d, out + i);
  if (i == n) return;
  HWY_ALIGN T rest[HWY_MAX_BYTES / sizeof(T)];
  const auto padded = [&](const T* from) HWY_ATTR {
    for (int64_t j = 0; j < lanes; ++j) rest[j] = i + j < n ? from[i + j] : T(0);
    return hn::Load(d, rest);
  };
  const auto y = f(padded(in)...);
  hn::Store(y, d, rest);
  for (int64_t j = 0; i + j < n; ++j) out[i + j] = rest[j];
}

/// Like map() for several results: f(v...) gets a vector of each array, by reference, and what it
/// leaves in the vectors of arrays that are not const is stored.
template <class F, class... Array>
HWY_INLINE void update(int64_t n, F f, Array*... arrays) {
  using T = std::common_type_t<std::remove_const_t<Array>...>;
  const hn::ScalableTag<T> d;
  const auto lanes = static_cast<int64_t>(hn::Lanes(d));
  const auto put = [&](auto v, auto* to) HWY_ATTR {
    if constexpr (!std::is_const_v<std::remove_pointer_t<decltype(to)>>) hn::StoreU(v, d, to);
  };
  const auto step = [&](Array*... at) HWY_ATTR {
    [&](auto... v) HWY_ATTR {
      f(v...);
      (put(v, at), ...);
    }(hn::LoadU(d, at)...);
  };
  int64_t i = 0;
  for (; i + lanes <= n; i += lanes) step((arrays + i)...);
  if (i == n) return;
  struct Padded {
    T lane[HWY_MAX_BYTES / sizeof(T)];
  };
  const auto padded = [&](const T* from) HWY_ATTR {
    Padded p{};
    for (int64_t j = 0; i + j < n; ++j) p.lane[j] = from[i + j];
    return p;
  };
  const auto back = [&](const Padded& p, auto* to) HWY_ATTR {
    if constexpr (!std::is_const_v<std::remove_pointer_t<decltype(to)>>)
      for (int64_t j = 0; i + j < n; ++j) to[i + j] = p.lane[j];
  };
  [&](auto... p) HWY_ATTR {
    step(p.lane...);
    (back(p, arrays), ...);
  }(padded(arrays)...);
}

/// t[j] += t[j + Half] for j < Half.
template <int Half, class T>
HWY_INLINE void add_halves(T* t) {
  const hn::CappedTag<T, Half> d;
  const auto width = static_cast<int64_t>(hn::Lanes(d));
  for (int64_t j = 0; j < Half; j += width)
    hn::StoreU(hn::Add(hn::LoadU(d, t + j), hn::LoadU(d, t + j + Half)), d, t + j);
}

/// Sum of f(in[i]...) over i < n. The order of every sum along memory: 64 bytes of lanes, lane j
/// adding the terms j, j + lanes, ... one after the other, then the lanes folded in halves. (Sums
/// across memory, over rows, have one chain for each column.)
template <class F, class T, class... More>
HWY_INLINE T sum_of(int64_t n, F f, const T* in, const More*... more) {
  constexpr int64_t lanes = 64 / sizeof(T);
  const hn::CappedTag<T, lanes> d;
  constexpr auto width = static_cast<int64_t>(hn::MaxLanes(hn::CappedTag<T, lanes>()));
  constexpr int64_t parts = lanes / width;
  hn::Vec<decltype(d)> total[parts];
  for (auto& t : total) t = hn::Zero(d);
  int64_t i = 0;
  for (; i + lanes <= n; i += lanes)
    for (int64_t p = 0; p < parts; ++p)
      total[p] = hn::Add(
          total[p], f(hn::LoadU(d, in + i + p * width), hn::LoadU(d, more + i + p * width)...));
  T term[lanes] = {};
  if (i < n) {  // terms beyond n are made zero after f
    map(n - i, term, f, in + i, (more + i)...);
    for (int64_t p = 0; p < parts; ++p)
      total[p] = hn::Add(total[p], hn::LoadU(d, term + p * width));
  }
  for (int64_t p = 0; p < parts; ++p) hn::StoreU(total[p], d, term + p * width);
  if constexpr (lanes == 16) add_halves<8>(term);
  add_halves<4>(term);
  return (term[0] + term[2]) + (term[1] + term[3]);
}

/// The largest of n > 0 numbers, NaN left out; -infinity if there are only those.
template <class T>
HWY_INLINE T max_of(int64_t n, const T* x) {
  const hn::ScalableTag<T> d;
  const auto lanes = static_cast<int64_t>(hn::Lanes(d));
  auto top = hn::Set(d, -std::numeric_limits<T>::infinity());
  int64_t i = 0;
  for (; i + lanes <= n; i += lanes) {
    const auto v = hn::LoadU(d, x + i);
    top = hn::IfThenElse(hn::Gt(v, top), v, top);
  }
  HWY_ALIGN T rest[HWY_MAX_BYTES / sizeof(T)];
  hn::Store(top, d, rest);
  T best = rest[0];
  for (int64_t j = 1; j < lanes; ++j) best = rest[j] > best ? rest[j] : best;
  for (; i < n; ++i) best = x[i] > best ? x[i] : best;
  return best;
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per target
