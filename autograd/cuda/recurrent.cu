// Recurrences: a product and a pass over the cells per step, launched without waiting.
#include "autograd/cuda/kernels.h"

namespace restage::cuda {
namespace {

template <class T>
RESTAGE_DEVICE T gate(T x) {
  return T(1) / (T(1) + exp(-x));
}

template <class T>
void gru_of(const GruArgs& args) {
  const int64_t steps = args.x.size(0), n = args.x.size(1), h = args.h0.size(1);
  Tensor input = empty_like(args.x, {steps * n, 3 * h}), hidden = empty_like(args.x, {n, 3 * h});
  matmul({.a = args.x.reshape({steps * n, args.x.size(2)}),
          .b = args.w_ih,
          .out = input,
          .transpose_b = true,
          .bias = &args.b_ih,
          .precision = args.precision});
  const T* gh = at<T>(hidden);
  for (int64_t t = 0; t < steps; ++t) {
    const Tensor before = t == 0 ? args.h0 : args.out.rows(t - 1, t).reshape({n, h});
    matmul({.a = before, .b = args.w_hh, .out = hidden, .transpose_b = true, .bias = &args.b_hh});
    const T *gi = at<T>(input) + t * n * 3 * h, *old = at<T>(before);
    T* out = at<T>(args.out) + t * n * h;
    T* gates = args.gates == nullptr ? nullptr : at<T>(*args.gates) + t * n * 4 * h;
    each(n * h, [=] RESTAGE_DEVICE(int64_t k) {
      const int64_t row = k / h * 3 * h + k % h;
      const T r = gate(gi[row] + gh[row]), z = gate(gi[row + h] + gh[row + h]);
      const T kept = gh[row + 2 * h], c = tanh(gi[row + 2 * h] + r * kept);
      out[k] = (T(1) - z) * c + z * old[k];
      if (gates == nullptr) return;
      T* to = gates + k / h * 4 * h + k % h;
      to[0] = r, to[h] = z, to[2 * h] = c, to[3 * h] = kept;
    });
  }
}

template <class T>
void gru_grad_of(const GruGradArgs& args) {
  const int64_t steps = args.gy.size(0), n = args.gy.size(1), h = args.gy.size(2);
  // Gradient of the state after the step, then of the state before it.
  T* g_state = at<T>(args.out);
  each(n * h, [=] RESTAGE_DEVICE(int64_t k) { g_state[k] = T(0); });
  for (int64_t t = steps - 1; t >= 0; --t) {
    const T *gates = at<T>(args.gates) + t * n * 4 * h, *gy = at<T>(args.gy) + t * n * h,
            *old = t > 0 ? at<T>(args.y) + (t - 1) * n * h : at<T>(args.h0);
    T *gi = at<T>(args.g_gi) + t * n * 3 * h, *gh = at<T>(args.g_gh) + t * n * 3 * h;
    each(n * h, [=] RESTAGE_DEVICE(int64_t k) {
      const T* of = gates + k / h * 4 * h + k % h;
      const T r = of[0], z = of[h], c = of[2 * h], kept = of[3 * h];
      const int64_t row = k / h * 3 * h + k % h;
      const T g = gy[k] + g_state[k], in = g * (T(1) - z) * (T(1) - c * c);
      gi[row] = gh[row] = in * kept * r * (T(1) - r);
      gi[row + h] = gh[row + h] = g * (old[k] - c) * z * (T(1) - z);
      gi[row + 2 * h] = in;
      gh[row + 2 * h] = in * r;
      g_state[k] = g * z;
    });
    matmul({.a = args.g_gh.rows(t, t + 1).reshape({n, 3 * h}),
            .b = args.w_hh,
            .out = args.out,
            .accumulate = true});
  }
}

template <class T>
void recurrence_of(const RecurrenceArgs& args) {
  const T *a = at<T>(args.a), *b = at<T>(args.b), *first = at<T>(args.first);
  T* out = at<T>(args.out);
  const int64_t steps = args.out.size(1), m = args.out.size(2);
  each(args.out.size(0) * m, [=] RESTAGE_DEVICE(int64_t k) {
    T y = first[k];
    for (int64_t t = 0; t < steps; ++t) {
      const int64_t i = (k / m * steps + t) * m + k % m;
      out[i] = y = a[i] * y + b[i];
    }
  });
}

template <class T>
void recurrence_grad_of(const RecurrenceGradArgs& args) {
  const T *a = at<T>(args.a), *y = at<T>(args.y), *first = at<T>(args.first), *gy = at<T>(args.gy);
  T *g_a = at<T>(args.g_a), *g_first = at<T>(args.g_first), *g_b = at<T>(args.out);
  const int64_t steps = args.out.size(1), m = args.out.size(2);
  each(args.out.size(0) * m, [=] RESTAGE_DEVICE(int64_t k) {
    T later = 0;
    for (int64_t t = steps - 1; t >= 0; --t) {
      const int64_t i = (k / m * steps + t) * m + k % m;
      g_b[i] = gy[i] + later;
      g_a[i] = g_b[i] * (t > 0 ? y[i - m] : first[k]);
      later = g_b[i] * a[i];
    }
    g_first[k] = later;
  });
}

}  // namespace

void gru(const GruArgs& args) { RESTAGE_FLOATS(args.out.dtype(), gru_of, args) }
void gru_grad(const GruGradArgs& args) { RESTAGE_FLOATS(args.out.dtype(), gru_grad_of, args) }
void recurrence(const RecurrenceArgs& args) {
  RESTAGE_FLOATS(args.out.dtype(), recurrence_of, args)
}
void recurrence_grad(const RecurrenceGradArgs& args) {
  RESTAGE_FLOATS(args.out.dtype(), recurrence_grad_of, args)
}

}  // namespace restage::cuda
