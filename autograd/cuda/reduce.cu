// Reductions over the middle axis of [outer, n, inner]. Sums are in double, in an order that sizes
// decide.
#include "autograd/cuda/kernels.h"
#include "autograd/cuda/sums.h"

namespace restage::cuda {
namespace {

template <class T>
void sum_of(const SumArgs& args) {
  const T* x = at<T>(args.x);
  T* out = at<T>(args.out);
  const int64_t n = args.n, inner = args.inner;
  sums(
      args.out, args.outer, n, inner,
      [=] RESTAGE_DEVICE(int64_t o, int64_t r, int64_t i) {
        return static_cast<double>(x[(o * n + r) * inner + i]);
      },
      [=] RESTAGE_DEVICE(int64_t k, double total) { out[k] = static_cast<T>(total); });
}

template <class T>
void max_of(const MaxArgs& args) {
  const T* x = at<T>(args.x);
  T* out = at<T>(args.out);
  int32_t* index = at<int32_t>(args.index);
  const int64_t n = args.n, inner = args.inner;
  sums<Largest<T>>(
      args.out, args.outer, n, inner,
      [=] RESTAGE_DEVICE(int64_t o, int64_t r, int64_t i) {
        return Largest<T>{x[(o * n + r) * inner + i], static_cast<int32_t>(r)};
      },
      [=] RESTAGE_DEVICE(int64_t k, const Largest<T>& top) {
        out[k] = top.value;
        index[k] = top.index;
      });
}

template <class T>
void max_grad_of(const MaxGradArgs& args) {
  const T* gy = at<T>(args.gy);
  T* out = at<T>(args.out);
  const int32_t* index = at<int32_t>(args.index);
  const int64_t n = args.n, inner = args.inner;
  each(args.outer * n * inner, [=] RESTAGE_DEVICE(int64_t k) {
    const int64_t o = k / (n * inner), r = k / inner % n, i = k % inner;
    out[k] = index[o * inner + i] == r ? gy[o * inner + i] : T(0);
  });
}

constexpr int64_t kShort = 32;  ///< numbers of a row that one thread goes through

template <class T>
void softmax_of_rows(const SoftmaxArgs& args) {
  const T* x = at<T>(args.x);
  T* out = at<T>(args.out);
  const int64_t n = args.n;
  groups(args.outer, [=] RESTAGE_DEVICE(const Group& g, int64_t o) {
    const T* from = x + o * n;
    T* to = out + o * n;
    const T top = g.sum<Largest<T>>(n, [&](int64_t r) { return Largest<T>{from[r], 0}; }).value;
    const T all = static_cast<T>(g.sum(n, [&](int64_t r) {
      const T e = exp(from[r] - top);
      to[r] = e;
      return static_cast<double>(e);
    }));
    g.each(n, [&](int64_t r) { to[r] /= all; });
  });
}

/// A group of threads for each long row; else a thread for each column.
template <class T>
void softmax_of(const SoftmaxArgs& args) {
  if (args.inner == 1 && args.n > kShort) return softmax_of_rows<T>(args);
  const T* x = at<T>(args.x);
  T* out = at<T>(args.out);
  const int64_t n = args.n, inner = args.inner;
  each(args.outer * inner, [=] RESTAGE_DEVICE(int64_t k) {
    const int64_t from = k / inner * n * inner + k % inner;
    T top = x[from];
    for (int64_t r = 1; r < n; ++r)
      if (x[from + r * inner] > top) top = x[from + r * inner];
    double total = 0;
    for (int64_t r = 0; r < n; ++r) {
      const T e = exp(x[from + r * inner] - top);
      out[from + r * inner] = e;
      total += static_cast<double>(e);
    }
    const T all = static_cast<T>(total);
    for (int64_t r = 0; r < n; ++r) out[from + r * inner] /= all;
  });
}

template <class T>
void softmax_grad_of(const SoftmaxGradArgs& args) {
  const T *y = at<T>(args.y), *gy = at<T>(args.gy);
  T* out = at<T>(args.out);
  const int64_t n = args.n, inner = args.inner;
  if (inner == 1 && n > kShort) {
    groups(args.outer, [=] RESTAGE_DEVICE(const Group& g, int64_t o) {
      const double total = g.sum(n, [&](int64_t r) {
        return static_cast<double>(y[o * n + r]) * static_cast<double>(gy[o * n + r]);
      });
      g.each(n, [&](int64_t r) {
        out[o * n + r] = y[o * n + r] * (gy[o * n + r] - static_cast<T>(total));
      });
    });
    return;
  }
  each(args.outer * inner, [=] RESTAGE_DEVICE(int64_t k) {
    const int64_t from = k / inner * n * inner + k % inner;
    double total = 0;
    for (int64_t r = 0; r < n; ++r)
      total += static_cast<double>(y[from + r * inner]) * static_cast<double>(gy[from + r * inner]);
    for (int64_t r = 0; r < n; ++r)
      out[from + r * inner] = y[from + r * inner] * (gy[from + r * inner] - static_cast<T>(total));
  });
}

}  // namespace

void sum(const SumArgs& args) { RESTAGE_FLOATS(args.out.dtype(), sum_of, args) }
void max(const MaxArgs& args) { RESTAGE_FLOATS(args.out.dtype(), max_of, args) }
void max_grad(const MaxGradArgs& args) { RESTAGE_FLOATS(args.out.dtype(), max_grad_of, args) }
void softmax(const SoftmaxArgs& args) {
  if (args.n > 0) RESTAGE_FLOATS(args.out.dtype(), softmax_of, args)
}
void softmax_grad(const SoftmaxGradArgs& args) {
  RESTAGE_FLOATS(args.out.dtype(), softmax_grad_of, args)
}

}  // namespace restage::cuda
