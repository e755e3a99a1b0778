// Norms of gradients, averages, and Adam in one pass over the parameter, its gradient and its
// moments: 28 bytes a number, of which every written one was read just before, so there is nothing
// to stream past the caches.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "autograd/cpu/update.cpp"
#include <hwy/foreach_target.h>  // once per instruction set

#include <algorithm>
#include <cmath>
#include <numeric>

#include "autograd/cpu/common.h"
#include "autograd/cpu/kernels.h"
#include "autograd/cpu/math-inl.h"
#include "autograd/cpu/targets.h"
#include "autograd/kernels/scratch.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {
namespace {

template <class T>
void adam_typed(const AdamArgs& args, const AdamArgs::Of& of) {
  const hn::ScalableTag<T> d;
  using V = hn::Vec<decltype(d)>;
  const double c1 = 1.0 - std::pow(args.beta1, static_cast<double>(of.step));
  const double c2 = 1.0 - std::pow(args.beta2, static_cast<double>(of.step));
  const auto number = [](double x) { return static_cast<T>(x); };
  const T step_size = number(args.lr / c1), root = number(1 / std::sqrt(c2)),
          eps = number(args.eps), b1 = number(args.beta1), b2 = number(args.beta2),
          decay = number(args.weight_decay), gs = number(args.gradient_scale),
          keep = number(args.keep);
  parallel_for(of.out.numel(), kGrain, [&](int64_t from, int64_t to) HWY_ATTR {
    const hn::ScalableTag<T> tag;
    const auto all = [&](T x) HWY_ATTR { return hn::Set(tag, x); };
    const auto moments = [&](V& w, V& m, V& v, V gradient) HWY_ATTR {
      const V g = hn::MulAdd(gradient, all(gs), hn::Mul(all(decay), w));
      m = hn::MulAdd(all(b1), m, hn::Mul(all(T(1) - b1), g));
      v = hn::MulAdd(all(b2), v, hn::Mul(all(T(1) - b2), hn::Mul(g, g)));
    };
    const auto move = [&](V w, V m, V v) HWY_ATTR {
      const V scale = hn::MulAdd(hn::Sqrt(v), all(root), all(eps));
      return hn::Sub(w, hn::Div(hn::Mul(all(step_size), m), scale));
    };
    T *w = of.out.data<T>() + from, *m = of.m.data<T>() + from, *v = of.v.data<T>() + from;
    const T* g = of.gradient.data<T>() + from;
    const auto step = [&](V& wv, V& mv, V& vv, V gv) HWY_ATTR {
      wv = hn::Mul(all(keep), wv);
      moments(wv, mv, vv, gv);
      wv = move(wv, mv, vv);
    };
    update(to - from, step, w, m, v, g);
  });
}

constexpr int64_t kChains = 32;  // sums side by side

/// Number i goes to chain i % kChains; the chains are added in order.
template <class T>
double squares(const T* x, int64_t n) {
  double chain[kChains] = {};
  int64_t i = 0;
  for (; i + kChains <= n; i += kChains)
    for (int64_t c = 0; c < kChains; ++c)
      chain[c] += static_cast<double>(x[i + c]) * static_cast<double>(x[i + c]);
  for (int64_t c = 0; i + c < n; ++c)
    chain[c] += static_cast<double>(x[i + c]) * static_cast<double>(x[i + c]);
  return std::accumulate(chain, chain + kChains, 0.0);
}

template <class T>
double squared_norm_typed(const T* x, int64_t n) {
  const int64_t parts = (n + kGrain - 1) / kGrain;
  Scratch<double> sums(static_cast<size_t>(parts));
  parallel_for(parts, 1, [&](int64_t from, int64_t to) HWY_ATTR {
    for (int64_t p = from; p < to; ++p)
      sums[p] = squares(x + p * kGrain, std::min(kGrain, n - p * kGrain));
  });
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

template <class T>
void mix_typed(const MixArgs& args, const MixArgs::Of& of) {
  const T keep = static_cast<T>(args.keep), add = static_cast<T>(args.add);
  parallel_for(of.out.numel(), kGrain, [&](int64_t from, int64_t to) HWY_ATTR {
    const hn::ScalableTag<T> tag;
    const auto step = [&](auto& y, auto x) HWY_ATTR {
      y = hn::MulAdd(hn::Set(tag, keep), y, hn::Mul(hn::Set(tag, add), x));
    };
    update(to - from, step, of.out.data<T>() + from, of.x.data<T>() + from);
  });
}

}  // namespace

void squared_norm(const SquaredNormArgs& args) {
  double* out = args.out.data<double>();
  for (const Tensor& x : args.all)
    dispatch(x.dtype(), [&](auto zero) HWY_ATTR {
      *out++ = squared_norm_typed(x.data<decltype(zero)>(), x.numel());
    });
}

void mix(const MixArgs& args) {
  for (const MixArgs::Of& of : args.all)
    dispatch(of.out.dtype(), [&](auto zero) HWY_ATTR { mix_typed<decltype(zero)>(args, of); });
}

void adam(const AdamArgs& args) {
  for (const AdamArgs::Of& of : args.all)
    dispatch(of.out.dtype(), [&](auto zero) HWY_ATTR { adam_typed<decltype(zero)>(args, of); });
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace restage::cpu {
RESTAGE_KERNEL(squared_norm, SquaredNormArgs)
RESTAGE_KERNEL(adam, AdamArgs)
RESTAGE_KERNEL(mix, MixArgs)
}  // namespace restage::cpu
#endif
