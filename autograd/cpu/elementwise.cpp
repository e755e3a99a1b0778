#include <cmath>
#include <cstring>

#include "autograd/cpu/common.h"
#include "autograd/cpu/kernels.h"

namespace restage::cpu {
namespace {

template <class T>
void apply_unary(Unary op, const ConstArray<T>& x, MutableArray<T>& y, T alpha) {
  switch (op) {
    case Unary::neg:
      y = -x;
      break;
    case Unary::exp:
      y = x.exp();
      break;
    case Unary::log:
      y = x.log();
      break;
    case Unary::sqrt:
      y = x.sqrt();
      break;
    case Unary::square:
      y = x.square();
      break;
    case Unary::abs:
      y = x.abs();
      break;
    case Unary::sigmoid:
      y = T(1) / (T(1) + (-x).exp());
      break;
    case Unary::tanh:
      y = x.tanh();
      break;
    case Unary::relu:
      y = (x <= T(0)).select(T(0), x);  // NaN stays NaN
      break;
    case Unary::leaky_relu:
      y = (x > T(0)).select(x, alpha * x);
      break;
    case Unary::softplus:
      y = x.max(T(0)) + (-x.abs()).exp().log1p();
      break;
    case Unary::scale:
      y = alpha * x;
      break;
    case Unary::add_scalar:
      y = x + alpha;
      break;
  }
}

template <class T>
void apply_unary_grad(Unary op, const ConstArray<T>& x, const ConstArray<T>& y,
                      const ConstArray<T>& g, MutableArray<T>& out, T alpha) {
  switch (op) {
    case Unary::neg:
      out = -g;
      break;
    case Unary::exp:
      out = g * y;
      break;
    case Unary::log:
      out = g / x;
      break;
    case Unary::sqrt:
      out = g * T(0.5) / y;
      break;
    case Unary::square:
      out = T(2) * g * x;
      break;
    case Unary::abs:
      out = g * x.sign();
      break;
    case Unary::sigmoid:
      out = g * y * (T(1) - y);
      break;
    case Unary::tanh:
      out = g * (T(1) - y.square());
      break;
    case Unary::relu:
      out = (x <= T(0)).select(T(0), g);
      break;
    case Unary::leaky_relu:
      out = (x > T(0)).select(g, alpha * g);
      break;
    case Unary::softplus:
      out = g / (T(1) + (-x).exp());
      break;
    case Unary::scale:
      out = alpha * g;
      break;
    case Unary::add_scalar:
      out = g;
      break;
  }
}

template <class T>
T combine(Binary op, T a, T b) {
  switch (op) {
    case Binary::add:
      return a + b;
    case Binary::sub:
      return a - b;
    case Binary::mul:
      return a * b;
    case Binary::div:
      return a / b;
  }
  return T(0);
}

/// Row-major walk with stride 0 along broadcast axes, after merging axes that both sides walk
/// alike.
struct BroadcastPlan {
  int64_t outer = 1, inner = 1;
  std::array<int64_t, Shape::kMaxRank> size{}, step_a{}, step_b{};
  int rank = 0;
  int64_t inner_a = 0, inner_b = 0;  // 1 or 0 along the innermost run

  BroadcastPlan(const Shape& a, const Shape& b, const Shape& out) {
    int64_t sa = 1, sb = 1;
    std::array<int64_t, Shape::kMaxRank> n{}, da{}, db{};
    int count = 0;  // innermost first
    for (int i = out.rank() - 1; i >= 0; --i) {
      const int ia = i - (out.rank() - a.rank()), ib = i - (out.rank() - b.rank());
      const int64_t la = ia < 0 ? 1 : a[ia], lb = ib < 0 ? 1 : b[ib];
      const int64_t ta = la == 1 && out[i] != 1 ? 0 : sa, tb = lb == 1 && out[i] != 1 ? 0 : sb;
      sa *= la;
      sb *= lb;
      if (out[i] == 1) continue;
      if (count > 0 && merges(ta, da[count - 1], n[count - 1]) &&
          merges(tb, db[count - 1], n[count - 1])) {
        n[count - 1] *= out[i];
        continue;
      }
      n[count] = out[i];
      da[count] = ta;
      db[count++] = tb;
    }
    if (count > 0) {
      inner = n[0];
      inner_a = da[0];
      inner_b = db[0];
    }
    rank = std::max(0, count - 1);
    for (int i = 0; i < rank; ++i) {  // outermost first
      size[i] = n[count - 1 - i];
      step_a[i] = da[count - 1 - i];
      step_b[i] = db[count - 1 - i];
      outer *= size[i];
    }
  }
  void offsets(int64_t index, int64_t* a, int64_t* b) const {
    *a = *b = 0;
    for (int i = rank - 1; i >= 0; --i) {
      const int64_t at = index % size[i];
      index /= size[i];
      *a += at * step_a[i];
      *b += at * step_b[i];
    }
  }

 private:
  static bool merges(int64_t outer_step, int64_t inner_step, int64_t inner_size) {
    return inner_step == 0 ? outer_step == 0 : outer_step == inner_step * inner_size;
  }
};

template <class T, Binary op>
void binary_rows(const T* a, const T* b, T* out, const BroadcastPlan& plan) {
  const int64_t n = plan.inner;
  const auto run = [&](int64_t row, int64_t from, int64_t to) {
    int64_t oa = 0, ob = 0;
    plan.offsets(row, &oa, &ob);
    const T* pa = a + oa;
    const T* pb = b + ob;
    T* po = out + row * n;
    if (plan.inner_a && plan.inner_b) {
      for (int64_t i = from; i < to; ++i) po[i] = combine<T>(op, pa[i], pb[i]);
    } else if (plan.inner_a) {
      const T v = *pb;
      for (int64_t i = from; i < to; ++i) po[i] = combine<T>(op, pa[i], v);
    } else if (plan.inner_b) {
      const T v = *pa;
      for (int64_t i = from; i < to; ++i) po[i] = combine<T>(op, v, pb[i]);
    } else {
      const T v = combine<T>(op, *pa, *pb);
      for (int64_t i = from; i < to; ++i) po[i] = v;
    }
  };
  if (plan.outer == 1) {
    parallel_for(n, kGrain, [&](int64_t from, int64_t to) { run(0, from, to); });
  } else {
    parallel_for(plan.outer, row_grain(n), [&](int64_t from, int64_t to) {
      for (int64_t row = from; row < to; ++row) run(row, 0, n);
    });
  }
}

}  // namespace

void unary(const UnaryArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    parallel_for(args.out.numel(), kGrain, [&](int64_t from, int64_t to) {
      MutableArray<T> y(args.out.data<T>() + from, to - from);
      apply_unary<T>(args.op, ConstArray<T>(args.x.data<T>() + from, to - from), y,
                     static_cast<T>(args.alpha));
    });
  });
}

void unary_grad(const UnaryGradArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    parallel_for(args.out.numel(), kGrain, [&](int64_t from, int64_t to) {
      const int64_t n = to - from;
      MutableArray<T> out(args.out.data<T>() + from, n);
      apply_unary_grad<T>(args.op, ConstArray<T>(args.x.data<T>() + from, n),
                          ConstArray<T>(args.y.data<T>() + from, n),
                          ConstArray<T>(args.gy.data<T>() + from, n), out,
                          static_cast<T>(args.alpha));
    });
  });
}

void binary(const BinaryArgs& args) {
  if (args.out.numel() == 0) return;
  const BroadcastPlan plan(args.a.shape(), args.b.shape(), args.out.shape());
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    const T *a = args.a.data<T>(), *b = args.b.data<T>();
    T* out = args.out.data<T>();
    switch (args.op) {
      case Binary::add:
        binary_rows<T, Binary::add>(a, b, out, plan);
        break;
      case Binary::sub:
        binary_rows<T, Binary::sub>(a, b, out, plan);
        break;
      case Binary::mul:
        binary_rows<T, Binary::mul>(a, b, out, plan);
        break;
      case Binary::div:
        binary_rows<T, Binary::div>(a, b, out, plan);
        break;
    }
  });
}

void expand(const ExpandArgs& args) {
  if (args.out.numel() == 0) return;
  const BroadcastPlan plan(args.x.shape(), args.x.shape(), args.out.shape());
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    const T* x = args.x.data<T>();
    T* out = args.out.data<T>();
    parallel_for(plan.outer, row_grain(plan.inner), [&](int64_t from, int64_t to) {
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
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    parallel_for(args.out.numel(), kGrain, [&](int64_t from, int64_t to) {
      MutableArray<T>(args.out.data<T>() + from, to - from) +=
          ConstArray<T>(args.a.data<T>() + from, to - from);
    });
  });
}

void dropout(const DropoutArgs& args) {
  // One Philox call gives the decisions of four neighbours.
  const auto limit = static_cast<uint32_t>(args.p * 4294967296.0);
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    const T* x = args.x.data<T>();
    T* out = args.out.data<T>();
    const T factor = static_cast<T>(1.0 / (1.0 - args.p));
    parallel_for(args.out.numel(), kGrain, [&](int64_t from, int64_t to) {
      std::array<uint32_t, 4> words{};
      for (int64_t i = from; i < to; ++i) {
        if (i % 4 == 0 || i == from) words = philox(args.key, static_cast<uint64_t>(i / 4));
        out[i] = words[static_cast<size_t>(i % 4)] < limit ? T(0) : x[i] * factor;
      }
    });
  });
}

void non_finite(const NonFiniteArgs& args) {
  int32_t found = 0;
  dispatch(args.x.dtype(), [&](auto zero) {
    using T = decltype(zero);
    const T* x = args.x.data<T>();
    for (int64_t i = 0; i < args.x.numel() && !found; ++i) found = !std::isfinite(x[i]);
  });
  args.out.data<int32_t>()[0] = found;
}

}  // namespace restage::cpu
