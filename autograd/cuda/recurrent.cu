// Recurrences. A GRU's steps are rounds of one launch: each group of threads keeps the weights of
// some units next to it, and all groups meet after every step. Where weights or batch are too large
// for that, a step is a product and a pass over the cells.
#include "autograd/cuda/kernels.h"

namespace restage::cuda {
namespace {

template <class T>
RESTAGE_DEVICE T gate(T x) {
  return T(1) / (T(1) + exp(-x));
}

/// A cell from W_i x + b_i and W_h h + b_h, gates r, z, n of `h` numbers each.
template <class T>
RESTAGE_DEVICE T cell(const T* gi, T gh_r, T gh_z, T kept, T old, int64_t h, T* gates) {
  const T r = gate(gi[0] + gh_r), z = gate(gi[h] + gh_z), c = tanh(gi[2 * h] + r * kept);
  if (gates != nullptr) gates[0] = r, gates[h] = z, gates[2 * h] = c, gates[3 * h] = kept;
  return (T(1) - z) * c + z * old;
}

/// Gradients of a cell's inputs from g, that of its state; returns what goes to the state before.
template <class T>
RESTAGE_DEVICE T cell_gradient(const T* gates, T old, T g, int64_t h, T* gi, T* gh) {
  const T r = gates[0], z = gates[h], c = gates[2 * h], kept = gates[3 * h];
  const T in = g * (T(1) - z) * (T(1) - c * c);
  gi[0] = gh[0] = in * kept * r * (T(1) - r);
  gi[h] = gh[h] = g * (old - c) * z * (T(1) - z);
  gi[2 * h] = in;
  gh[2 * h] = in * r;
  return g * z;
}

// ---- rounds of one launch
// ------------------------------------------------------------------------

template <class T>
struct alignas(16) Four {
  T at[4];
};

/// Who computes what: groups have `units` each and keep `outputs` rows of `width` weights for each
/// of them. Products are made in kParts interleaved parts, of some columns at a time.
template <class T>
struct Shares {
  static constexpr int64_t kParts = 8, kMostRows = 128;
  Shares(int64_t n, int64_t h, int64_t outputs, int64_t width)
      : units((h + rounds_limits().groups - 1) / rounds_limits().groups),
        groups((h + units - 1) / units),
        weights(units * outputs * width),
        parts(units * outputs * n * kParts) {
    const int64_t room = rounds_limits().bytes / static_cast<int64_t>(sizeof(T)) - weights - parts;
    columns = std::min(width, (room / std::max<int64_t>(n, 1) - 4) / 32 * 32);
    bytes = (weights + parts + n * (columns + 4)) * static_cast<int64_t>(sizeof(T));
    fit = h % 4 == 0 && n > 0 && n <= kMostRows && (columns == width || columns >= 32);
  }
  int64_t units, groups, weights, parts, columns = 0, bytes = 0;
  bool fit = false;
};

/// What a group keeps: weights [units, outputs, width], partial products [part, unit, row,
/// outputs], some columns of the states. A pair is a row of the batch and a unit.
template <class T, int kOutputs>
struct Kept {
  RESTAGE_DEVICE Kept(double* room, const Shares<T>& s, int64_t of_group, int64_t batch, int64_t h)
      : weights(reinterpret_cast<T*>(room)),
        parts(weights + s.weights),
        states(parts + s.parts),
        n(batch),
        first(of_group * s.units),
        pairs(batch * (h - first < s.units ? h - first : s.units)),
        columns(s.columns),
        apart(s.columns + 4) {}

  /// Of all pairs, over `width` columns of `x` [n, width].
  RESTAGE_DEVICE void multiply(const Group& g, const T* x, int64_t width) const {
    g.each(pairs * Shares<T>::kParts * kOutputs, [&](int64_t i) { parts[i] = T(0); });
    for (int64_t from = 0; from < width; from += columns) {
      const int64_t count = width - from < columns ? width - from : columns;
      g.each(kThreads, [&](int64_t t) {
        for (int64_t row = 0; row < n; ++row)
          for (int64_t c = t; c < count; c += kThreads)
            states[row * apart + c] = x[row * width + from + c];
      });
      g.each(pairs * Shares<T>::kParts,
             [&](int64_t item) { add_part(item, from, count / 4, width); });
    }
  }
  RESTAGE_DEVICE void add_part(int64_t item, int64_t from, int64_t fours, int64_t width) const {
    const int64_t part = item / pairs, pair = item % pairs;
    const T *state = states + pair % n * apart, *w = weights + pair / n * kOutputs * width + from;
    T sum[kOutputs];
    for (int o = 0; o < kOutputs; ++o) sum[o] = parts[item * kOutputs + o];
    for (int64_t i = part; i < fours; i += Shares<T>::kParts) {
      const auto x = reinterpret_cast<const Four<T>*>(state)[i];
      for (int o = 0; o < kOutputs; ++o) {
        const auto y = reinterpret_cast<const Four<T>*>(w + o * width)[i];
        for (int e = 0; e < 4; ++e) sum[o] = fma(x.at[e], y.at[e], sum[o]);
      }
    }
    for (int o = 0; o < kOutputs; ++o) parts[item * kOutputs + o] = sum[o];
  }
  RESTAGE_DEVICE T product(int64_t pair, int output) const {
    T sum = 0;
    for (int64_t p = 0; p < Shares<T>::kParts; ++p)
      sum += parts[(p * pairs + pair) * kOutputs + output];
    return sum;
  }
  RESTAGE_DEVICE int64_t row(int64_t pair) const { return pair % n; }
  RESTAGE_DEVICE int64_t unit(int64_t pair) const { return first + pair / n; }

  T *weights, *parts, *states;
  int64_t n, first, pairs, columns, apart;
};

template <class T>
void gru_rounds(const GruArgs& args, const Shares<T>& shares, const Tensor& input) {
  const int64_t steps = args.x.size(0), n = args.x.size(1), h = args.h0.size(1);
  const T *w = at<T>(args.w_hh), *b = at<T>(args.b_hh), *h0 = at<T>(args.h0), *gi = at<T>(input);
  T *out = at<T>(args.out), *gates = at<T>(args.gates);
  rounds(shares.groups, steps, shares.bytes,
         [=] RESTAGE_DEVICE(const Group& g, double* room, int64_t group, int64_t t) {
           const Kept<T, 3> kept(room, shares, group, n, h);
           if (t == 0)
             g.each(kept.pairs / n * 3 * h, [&](int64_t i) {
               const int64_t unit = i / (3 * h), k = i / h % 3;
               kept.weights[i] = w[(k * h + kept.first + unit) * h + i % h];
             });
           const T* before = t == 0 ? h0 : out + (t - 1) * n * h;
           kept.multiply(g, before, h);
           g.each(kept.pairs, [&](int64_t pair) {
             const int64_t unit = kept.unit(pair), row = t * n + kept.row(pair);
             out[row * h + unit] =
                 cell(gi + row * 3 * h + unit, b[unit] + kept.product(pair, 0),
                      b[h + unit] + kept.product(pair, 1), b[2 * h + unit] + kept.product(pair, 2),
                      before[kept.row(pair) * h + unit], h,
                      gates == nullptr ? nullptr : gates + row * 4 * h + unit);
           });
         });
}

/// Round r brings the gradient of the state after step steps - 1 - r together; the last, that of
/// the first state.
template <class T>
void gru_grad_rounds(const GruGradArgs& args, const Shares<T>& shares) {
  const int64_t steps = args.gy.size(0), n = args.gy.size(1), h = args.gy.size(2);
  const T *w = at<T>(args.w_hh), *gates = at<T>(args.gates), *gy = at<T>(args.gy),
          *y = at<T>(args.y), *h0 = at<T>(args.h0);
  T *gi = at<T>(args.g_gi), *gh = at<T>(args.g_gh), *g_state = at<T>(args.out);
  rounds(shares.groups, steps + 1, shares.bytes,
         [=] RESTAGE_DEVICE(const Group& g, double* room, int64_t group, int64_t round) {
           const Kept<T, 1> kept(room, shares, group, n, h);
           if (round == 0)
             g.each(kept.pairs / n * 3 * h, [&](int64_t i) {
               kept.weights[i] = w[i % (3 * h) * h + kept.first + i / (3 * h)];
             });
           const int64_t t = steps - 1 - round;
           if (round > 0) kept.multiply(g, gh + (t + 1) * n * 3 * h, 3 * h);
           g.each(kept.pairs, [&](int64_t pair) {
             const int64_t unit = kept.unit(pair), in_batch = kept.row(pair) * h + unit;
             const T later = round > 0 ? g_state[in_batch] + kept.product(pair, 0) : T(0);
             if (t < 0) {
               g_state[in_batch] = later;
               return;
             }
             const int64_t row = t * n + kept.row(pair);
             g_state[in_batch] = cell_gradient(
                 gates + row * 4 * h + unit, t > 0 ? y[(row - n) * h + unit] : h0[in_batch],
                 gy[row * h + unit] + later, h, gi + row * 3 * h + unit, gh + row * 3 * h + unit);
           });
         });
}

// ---- a product and a pass for each step
// ----------------------------------------------------------

template <class T>
void gru_of(const GruArgs& args) {
  const int64_t steps = args.x.size(0), n = args.x.size(1), h = args.h0.size(1);
  Tensor input = empty_like(args.x, {steps * n, 3 * h});
  matmul({.a = args.x.reshape({steps * n, args.x.size(2)}),
          .b = args.w_ih,
          .out = input,
          .transpose_b = true,
          .bias = &args.b_ih,
          .precision = args.precision});
  if (const Shares<T> shares(n, h, 3, h); shares.fit) return gru_rounds<T>(args, shares, input);
  Tensor hidden = empty_like(args.x, {n, 3 * h});
  const T* gh = at<T>(hidden);
  for (int64_t t = 0; t < steps; ++t) {
    const Tensor before = t == 0 ? args.h0 : args.out.rows(t - 1, t).reshape({n, h});
    matmul({.a = before, .b = args.w_hh, .out = hidden, .transpose_b = true, .bias = &args.b_hh});
    const T *gi = at<T>(input) + t * n * 3 * h, *old = at<T>(before);
    T* out = at<T>(args.out) + t * n * h;
    T* gates = args.gates == nullptr ? nullptr : at<T>(*args.gates) + t * n * 4 * h;
    rows(n, h, [=] RESTAGE_DEVICE(int64_t row, int64_t unit) {
      const T* by = gh + row * 3 * h + unit;
      out[row * h + unit] =
          cell(gi + row * 3 * h + unit, by[0], by[h], by[2 * h], old[row * h + unit], h,
               gates == nullptr ? nullptr : gates + row * 4 * h + unit);
    });
  }
}

template <class T>
void gru_grad_of(const GruGradArgs& args) {
  const int64_t steps = args.gy.size(0), n = args.gy.size(1), h = args.gy.size(2);
  if (const Shares<T> shares(n, h, 1, 3 * h); shares.fit && steps > 0)
    return gru_grad_rounds<T>(args, shares);
  // Gradient of the state after the step, then of the state before it.
  T* g_state = at<T>(args.out);
  each(n * h, [=] RESTAGE_DEVICE(int64_t k) { g_state[k] = T(0); });
  for (int64_t t = steps - 1; t >= 0; --t) {
    const T *gates = at<T>(args.gates) + t * n * 4 * h, *gy = at<T>(args.gy) + t * n * h,
            *old = t > 0 ? at<T>(args.y) + (t - 1) * n * h : at<T>(args.h0);
    T *gi = at<T>(args.g_gi) + t * n * 3 * h, *gh = at<T>(args.g_gh) + t * n * 3 * h;
    rows(n, h, [=] RESTAGE_DEVICE(int64_t row, int64_t unit) {
      const int64_t k = row * h + unit;
      g_state[k] = cell_gradient(gates + row * 4 * h + unit, old[k], gy[k] + g_state[k], h,
                                 gi + row * 3 * h + unit, gh + row * 3 * h + unit);
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
