#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "autograd/cpu/elementwise.cpp"
#include <hwy/foreach_target.h>  // once per instruction set

#include <algorithm>
#include <atomic>

#include "autograd/cpu/broadcast.h"
#include "autograd/cpu/common.h"
#include "autograd/cpu/kernels.h"
#include "autograd/cpu/math-inl.h"
#include "autograd/cpu/philox-inl.h"
#include "autograd/cpu/targets.h"
#include "autograd/kernels/binary_values.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {
namespace {

// Of each row a case: the value of x, the gradient of g and of what is kept, which the row calls x
// or y. The number of a row has the row's name for it.
#define RESTAGE_CASE(name, help, kept, domain, value, gradient) \
  RESTAGE_CASE_WITH_NUMBER(name, number, 0, help, kept, domain, value, gradient)

template <class T>
void apply_unary(Unary op, int64_t n, const T* in, T* out, T of_op) {
  using N = Numbers<T>;
  using V = typename N::Vector;
  [[maybe_unused]] const N zero(T(0)), one(T(1));
  switch (op) {
#define RESTAGE_CASE_WITH_NUMBER(name, number, tried, help, kept, domain, value, gradient) \
  case Unary::name: {                                                                      \
    [[maybe_unused]] const N number(of_op);                                                \
    const auto f = [&](V v) HWY_ATTR {                                                     \
      const N x(v);                                                                        \
      return (value).v;                                                                    \
    };                                                                                     \
    return map(n, out, f, in);                                                             \
  }
    RESTAGE_UNARY(RESTAGE_CASE)
    RESTAGE_UNARY_WITH_NUMBER(RESTAGE_CASE_WITH_NUMBER)
#undef RESTAGE_CASE_WITH_NUMBER
  }
}

template <class T>
void apply_unary_grad(Unary op, int64_t n, const T* of, const T* gy, T* out, T of_op) {
  using N = Numbers<T>;
  using V = typename N::Vector;
  [[maybe_unused]] const N zero(T(0)), one(T(1));
  switch (op) {
#define RESTAGE_CASE_WITH_NUMBER(name, number, tried, help, kept, domain, value, gradient) \
  case Unary::name: {                                                                      \
    [[maybe_unused]] const N number(of_op);                                                \
    const auto f = [&](V first, V v) HWY_ATTR {                                            \
      [[maybe_unused]] const N g(first), x(v), y(v);                                       \
      return (gradient).v;                                                                 \
    };                                                                                     \
    return map(n, out, f, gy, Derivative::kept == Derivative::of_nothing ? gy : of);       \
  }
    RESTAGE_UNARY(RESTAGE_CASE)
    RESTAGE_UNARY_WITH_NUMBER(RESTAGE_CASE_WITH_NUMBER)
#undef RESTAGE_CASE_WITH_NUMBER
  }
}
#undef RESTAGE_CASE

/// out[i] = f(i, number of a, number of b) for all numbers of the result.
template <class T, class F>
void combine(const T* a, const T* b, T* out, const BroadcastPlan& plan, const F& f) {
  const int64_t n = plan.inner;
  const auto run = [&](int64_t row, int64_t from, int64_t to) HWY_ATTR {
    int64_t oa = 0, ob = 0;
    plan.offsets(row, &oa, &ob);
    const T *pa = a + oa, *pb = b + ob;
    const int64_t first = row * n;
    if (plan.inner_a == plan.inner_b) {  // neither is repeated, unless n is 1
      for (int64_t i = from; i < to; ++i) out[first + i] = f(first + i, pa[i], pb[i]);
    } else if (plan.inner_a) {
      const T v = *pb;
      for (int64_t i = from; i < to; ++i) out[first + i] = f(first + i, pa[i], v);
    } else {
      const T v = *pa;
      for (int64_t i = from; i < to; ++i) out[first + i] = f(first + i, v, pb[i]);
    }
  };
  if (plan.outer == 1) {
    parallel_for(n, kGrain, [&](int64_t from, int64_t to) HWY_ATTR { run(0, from, to); });
  } else {
    parallel_for(plan.outer, row_grain(n), [&](int64_t from, int64_t to) HWY_ATTR {
      for (int64_t row = from; row < to; ++row) run(row, 0, n);
    });
  }
}

template <class T>
void binary_of(const BinaryArgs& args, const BroadcastPlan& plan) {
  const T *a = args.a.data<T>(), *b = args.b.data<T>();
  T* out = args.out.data<T>();
  switch (args.op) {
#define RESTAGE_CASE(name, ...)                                         \
  case Binary::name: {                                                  \
    const auto f = [](int64_t, T x, T y) HWY_ATTR {                     \
      return binary_values::Row<Binary::name>::template value<T>(x, y); \
    };                                                                  \
    return combine(a, b, out, plan, f);                                 \
  }
    RESTAGE_BINARY(RESTAGE_CASE)
#undef RESTAGE_CASE
  }
}

template <class T, int input>
void binary_grad_of(const BinaryGradArgs& args) {
  const Tensor &a = args.a ? *args.a : args.gy, &b = args.b ? *args.b : args.gy;
  const BroadcastPlan plan(a.shape(), b.shape(), args.out.shape());
  const T *pa = a.data<T>(), *pb = b.data<T>(), *g = args.gy.data<T>();
  T* out = args.out.data<T>();
  switch (args.op) {
#define RESTAGE_CASE(name, ...)                                                \
  case Binary::name: {                                                         \
    const auto f = [g](int64_t i, T x, T y) HWY_ATTR {                         \
      return binary_values::Row<Binary::name>::template by<input>(g[i], x, y); \
    };                                                                         \
    return combine(pa, pb, out, plan, f);                                      \
  }
    RESTAGE_BINARY(RESTAGE_CASE)
#undef RESTAGE_CASE
  }
}

/// factors[i] = 0 with probability limit / 2^32 and else `kept`; one Philox call decides for four
/// neighbours. first and count are multiples of 32.
template <class T>
void dropout_factors(const RngKey& key, uint32_t limit, T kept, int64_t first, int64_t count,
                     uint32_t* words, T* factors) {
  philox_words(key, static_cast<uint64_t>(first / 4), count / 4, words);
  for (int64_t i = 0; i < count; ++i) factors[i] = words[i] < limit ? T(0) : kept;
}

}  // namespace

void unary(const UnaryArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR {
    using T = decltype(zero);
    parallel_for(args.out.numel(), kGrain, [&](int64_t from, int64_t to) HWY_ATTR {
      apply_unary<T>(args.op, to - from, args.x.data<T>() + from, args.out.data<T>() + from,
                     static_cast<T>(args.number));
    });
  });
}

void unary_grad(const UnaryGradArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR {
    using T = decltype(zero);
    const T* kept = args.kept ? args.kept->data<T>() : nullptr;
    parallel_for(args.out.numel(), kGrain, [&](int64_t from, int64_t to) HWY_ATTR {
      apply_unary_grad<T>(args.op, to - from, kept ? kept + from : nullptr,
                          args.gy.data<T>() + from, args.out.data<T>() + from,
                          static_cast<T>(args.number));
    });
  });
}

void binary(const BinaryArgs& args) {
  if (args.out.numel() == 0) return;
  const BroadcastPlan plan(args.a.shape(), args.b.shape(), args.out.shape());
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR { binary_of<decltype(zero)>(args, plan); });
}

void binary_grad(const BinaryGradArgs& args) {
  if (args.out.numel() == 0) return;
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR {
    using T = decltype(zero);
    args.input == 0 ? binary_grad_of<T, 0>(args) : binary_grad_of<T, 1>(args);
  });
}

void expand(const ExpandArgs& args) {
  if (args.out.numel() == 0) return;
  const BroadcastPlan plan(args.x.shape(), args.x.shape(), args.out.shape());
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR {
    using T = decltype(zero);
    const T* x = args.x.data<T>();
    T* out = args.out.data<T>();
    parallel_for(plan.outer, row_grain(plan.inner), [&](int64_t from, int64_t to) HWY_ATTR {
      for (int64_t row = from; row < to; ++row) {
        int64_t oa = 0, ob = 0;
        plan.offsets(row, &oa, &ob);
        T* po = out + row * plan.inner;
        for (int64_t i = 0; i < plan.inner; ++i) po[i] = x[oa + (plan.inner_a ? i : 0)];
      }
    });
  });
}

void accumulate(const AccumulateArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR {
    using T = decltype(zero);
    parallel_for(args.out.numel(), kGrain, [&](int64_t from, int64_t to) HWY_ATTR {
      T* out = args.out.data<T>();
      const T* a = args.a.data<T>();
      for (int64_t i = from; i < to; ++i) out[i] += a[i];
    });
  });
}

void dropout(const DropoutArgs& args) {
  const auto limit = static_cast<uint32_t>(args.p * 4294967296.0);
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR {
    using T = decltype(zero);
    const T kept = static_cast<T>(1.0 / (1.0 - args.p));
    parallel_for(args.out.numel(), kGrain, [&](int64_t from, int64_t to) HWY_ATTR {
      constexpr int64_t kBlock = 256;  // divides kGrain
      uint32_t words[kBlock];
      T factors[kBlock];
      const auto drop = [](auto x, auto f) HWY_ATTR {  // NaN and infinity, too
        return hn::IfThenZeroElse(hn::Eq(f, hn::Zero(hn::DFromV<decltype(f)>())), hn::Mul(x, f));
      };
      const auto drop_relu = [&](auto x, auto f) HWY_ATTR {
        return drop(hn::IfThenZeroElse(hn::Le(x, hn::Zero(hn::DFromV<decltype(x)>())), x), f);
      };
      for (int64_t i = from; i < to; i += kBlock) {
        dropout_factors(args.key, limit, kept, i, kBlock, words, factors);
        const T *x = args.x.data<T>() + i, *f = factors;
        T* out = args.out.data<T>() + i;
        if (args.relu) {
          map(std::min(kBlock, to - i), out, drop_relu, x, f);
        } else {
          map(std::min(kBlock, to - i), out, drop, x, f);
        }
      }
    });
  });
}

void relu_dropout_grad(const ReluDropoutGradArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR {
    using T = decltype(zero);
    const auto kept = static_cast<T>(1.0 / (1.0 - args.p));
    const auto pass = [kept](auto g, auto y) HWY_ATTR {
      const hn::DFromV<decltype(y)> d;
      return hn::IfThenZeroElse(hn::Le(y, hn::Zero(d)), hn::Mul(g, hn::Set(d, kept)));
    };
    parallel_for(args.out.numel(), kGrain, [&](int64_t from, int64_t to) HWY_ATTR {
      map(to - from, args.out.data<T>() + from, pass, args.gy.data<T>() + from,
          args.y.data<T>() + from);
    });
  });
}

void non_finite(const NonFiniteArgs& args) {
  std::atomic<int32_t> found = 0;
  dispatch(args.x.dtype(), [&](auto zero) HWY_ATTR {
    using T = decltype(zero);
    const T* x = args.x.data<T>();
    parallel_for(args.x.numel(), kGrain, [&](int64_t from, int64_t to) HWY_ATTR {
      int32_t bad = 0;
      for (int64_t i = from; i < to; ++i) bad |= x[i] - x[i] != T(0);  // NaN for both kinds
      if (bad) found = 1;
    });
  });
  args.out.data<int32_t>()[0] = found;
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace restage::cpu {
RESTAGE_KERNEL(unary, UnaryArgs)
RESTAGE_KERNEL(unary_grad, UnaryGradArgs)
RESTAGE_KERNEL(binary, BinaryArgs)
RESTAGE_KERNEL(binary_grad, BinaryGradArgs)
RESTAGE_KERNEL(expand, ExpandArgs)
RESTAGE_KERNEL(accumulate, AccumulateArgs)
RESTAGE_KERNEL(dropout, DropoutArgs)
RESTAGE_KERNEL(relu_dropout_grad, ReluDropoutGradArgs)
RESTAGE_KERNEL(non_finite, NonFiniteArgs)
}  // namespace restage::cpu
#endif
