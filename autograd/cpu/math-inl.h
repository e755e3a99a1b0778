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

template <class V>
HWY_INLINE V exp(V x) {
  const hn::DFromV<V> d;
  using T = Lane<V>;
  const V limit = hn::Set(d, std::log(std::numeric_limits<T>::max()));
  const V infinity = hn::Set(d, std::numeric_limits<T>::infinity());
  return keep_nan(x, hn::IfThenElse(hn::Gt(x, limit), infinity, hn::Exp(d, hn::Min(x, limit))));
}

template <class V>
HWY_INLINE V tanh(V x) {
  return keep_nan(x, hn::Tanh(hn::DFromV<V>(), x));
}

template <class V>
HWY_INLINE V sigmoid(V x) {
  const V one = hn::Set(hn::DFromV<V>(), Lane<V>(1));
  return hn::Div(one, hn::Add(one, exp(hn::Neg(x))));
}

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

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per target
