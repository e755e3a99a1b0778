// Neighbour attention (kernels/attention.h), a few clouds at a time, so that tensors over pairs of
// points stay small. cuBLAS makes the products, and one pass each does what is between them. Only
// the softmax is kept for the backward pass, which computes everything else again.
#include "autograd/cuda/indices.h"
#include "autograd/cuda/kernels.h"

namespace restage::cuda {
namespace {

constexpr int64_t kPairs = 1 << 16;  ///< of the clouds that are handled at once

template <class T>
RESTAGE_DEVICE T relu_of(T x) {
  return x <= T(0) ? T(0) : x;
}

/// Some clouds of the inputs, as kernels see them; pairs are numbered by point and neighbour.
template <class T>
struct Pairs {
  Pairs(const NeighbourAttentionInputs& in, int64_t first, int64_t last)
      : v(in.index.size(1)),
        k(in.index.size(2)),
        d(in.query.size(2)),
        points((last - first) * v),
        count(points * k),
        index(at<int32_t>(in.index) + first * v * k),
        xyz(at<T>(in.xyz) + first * v * 3),
        query(at<T>(in.query) + first * v * d),
        key(at<T>(in.key) + first * v * d),
        value(at<T>(in.value) + first * v * d),
        scale(static_cast<T>(in.scale)) {}
  RESTAGE_DEVICE int64_t point(int64_t pair) const { return pair / k; }
  RESTAGE_DEVICE int64_t neighbour(int64_t pair) const {
    const int64_t i = index[pair];
    return pair / k / v * v + (i >= 0 && i < v ? i : 0);
  }
  int64_t v, k, d, points, count;
  const int32_t* index;
  const T *xyz, *query, *key, *value;
  T scale;
};

/// Calls f(pairs, first, last) for the clouds from first to last, until all were handled.
template <class T, class F>
void for_parts(const NeighbourAttentionInputs& in, F f) {
  const int64_t n = in.index.size(0), each_has = in.index.size(1) * in.index.size(2);
  if (each_has == 0) return;
  const int64_t at_once = std::max<int64_t>(1, kPairs / each_has);
  for (int64_t first = 0; first < n; first += at_once) {
    const int64_t last = std::min(n, first + at_once);
    f(Pairs<T>(in, first, last), first, last);
  }
}

/// r and 1 of every pair, [pairs, 4].
template <class T>
Tensor offsets(const NeighbourAttentionInputs& in, const Pairs<T>& p) {
  Tensor out = empty_like(in.xyz, {p.count, 4});
  T* to = at<T>(out);
  each(p.count * 4, [=] RESTAGE_DEVICE(int64_t i) {
    const int64_t pair = i / 4, c = i % 4;
    to[i] = c == 3 ? T(1) : p.xyz[3 * p.point(pair) + c] - p.xyz[3 * p.neighbour(pair) + c];
  });
  return out;
}

/// relu(W r + b), [pairs, d].
template <class T>
Tensor hidden(const NeighbourAttentionInputs& in, const Pairs<T>& p, const Tensor& offsets) {
  Tensor out = empty_like(in.xyz, {p.count, p.d});
  const T *r = at<T>(offsets), *w = at<T>(in.w), *b = at<T>(in.b);
  T* to = at<T>(out);
  rows(p.count, p.d, [=] RESTAGE_DEVICE(int64_t pair, int64_t c) {
    const T *of = r + pair * 4, *row = w + 3 * c;
    to[pair * p.d + c] = relu_of(fma(row[2], of[2], fma(row[1], of[1], fma(row[0], of[0], b[c]))));
  });
  return out;
}

/// relu(query - key + s), [pairs, d]; st: the rows [s, t].
template <class T>
Tensor score_inputs(const NeighbourAttentionInputs& in, const Pairs<T>& p, const Tensor& st) {
  Tensor out = empty_like(in.xyz, {p.count, p.d});
  const T* s = at<T>(st);
  T* to = at<T>(out);
  rows(p.count, p.d, [=] RESTAGE_DEVICE(int64_t pair, int64_t c) {
    to[pair * p.d + c] = relu_of(p.query[p.point(pair) * p.d + c] -
                                 p.key[p.neighbour(pair) * p.d + c] + s[pair * 2 * p.d + c]);
  });
  return out;
}

/// Softmax over neighbours, a thread for each channel of a point; e becomes its weights.
template <class T>
void pool(const Pairs<T>& p, const T* st, T* e, T* out) {
  rows(p.points, p.d, [=] RESTAGE_DEVICE(int64_t point, int64_t c) {
    const int64_t first = point * p.k;
    T* score = e + first * p.d + c;
    T top = score[0], total = 1;  // of exp(score - top), over those that were seen
    for (int64_t j = 1; j < p.k; ++j) {
      const T next = score[j * p.d], larger = next > top ? next : top;
      total = total * exp((top - larger) * p.scale) + exp((next - larger) * p.scale);
      top = larger;
    }
    const T inverse = T(1) / total;
    T sum = 0;
    for (int64_t j = 0; j < p.k; ++j) {
      const T weight = score[j * p.d] = exp((score[j * p.d] - top) * p.scale) * inverse;
      sum =
          fma(weight,
              p.value[p.neighbour(first + j) * p.d + c] + st[((first + j) * 2 + 1) * p.d + c], sum);
    }
    out[point * p.d + c] = sum;
  });
}

template <class T>
void cloud_answers(const NeighbourAttentionArgs& args, const Pairs<T>& p, int64_t first,
                   int64_t last) {
  const Shape rows{p.count, p.d};
  const MatmulPrecision precision = args.in.precision;
  Tensor st = empty_like(args.out, {p.count, 2 * p.d}),
         e = args.weights == nullptr ? empty_like(args.out, rows)
                                     : args.weights->rows(first, last).reshape(rows);
  const Tensor h = hidden(args.in, p, offsets(args.in, p));
  matmul({.a = h, .b = args.in.both, .out = st, .transpose_b = true, .precision = precision});
  const Tensor u = score_inputs(args.in, p, st);
  matmul({.a = u, .b = args.in.gamma, .out = e, .transpose_b = true, .precision = precision});
  pool(p, at<T>(st), at<T>(e), at<T>(args.out) + first * p.v * p.d);
}

template <class T>
void attention_of(const NeighbourAttentionArgs& args) {
  look_at(args.in.index, args.in.index.size(1));
  for_parts<T>(args.in, [&](const Pairs<T>& p, int64_t first, int64_t last) {
    cloud_answers(args, p, first, last);
  });
}

// ---- backward ----------------------------------------------------------------------------------

/// Of the scores, [pairs, d], and of t: the second half of the rows of `g_st`.
template <class T>
Tensor score_gradients(const Pairs<T>& p, const T* st, const T* weights, const T* y, const T* gy,
                       const Tensor& g_st) {
  Tensor out = empty_like(g_st, {p.count, p.d});
  T *g_e = at<T>(out), *g_t = at<T>(g_st);
  rows(p.count, p.d, [=] RESTAGE_DEVICE(int64_t pair, int64_t c) {
    const int64_t i = pair * p.d + c, of = p.point(pair) * p.d + c, t_at = (2 * pair + 1) * p.d + c;
    const T g = weights[i] * gy[of];
    g_t[t_at] = g;
    g_e[i] = p.scale * g * (p.value[p.neighbour(pair) * p.d + c] + st[t_at] - y[of]);
  });
  return out;
}

/// Some columns of rows that are `apart` long.
struct Columns {
  int64_t from, width, apart;
};

/// out [points, width] = sums over a point's own pairs.
template <class T>
void sum_own(const Pairs<T>& p, const T* values, Columns in, T* out) {
  rows(p.points, in.width, [=] RESTAGE_DEVICE(int64_t point, int64_t c) {
    const T* row = values + point * p.k * in.apart + in.from + c;
    double total = 0;
    for (int64_t j = 0; j < p.k; ++j) total += static_cast<double>(row[j * in.apart]);
    out[point * in.width + c] = static_cast<T>(total);
  });
}

/// out [points, width] = kept times out + sign times sums over the pairs whose neighbour a point
/// is.
template <class T>
void sum_asked(const Pairs<T>& p, const AskersAt& askers, const T* values, Columns in, double kept,
               double sign, T* out) {
  rows(p.points, in.width, [=] RESTAGE_DEVICE(int64_t point, int64_t c) {
    const double total = askers.sum(point, [&](int64_t pair) {
      return static_cast<double>(values[pair * in.apart + in.from + c]);
    });
    const int64_t i = point * in.width + c;
    out[i] = static_cast<T>((kept == 0 ? 0 : kept * static_cast<double>(out[i])) + sign * total);
  });
}

/// The first half of the rows of `g_st`: those of the scores' inputs where their ReLU was on.
template <class T>
void keep_on(const Pairs<T>& p, const Tensor& u, const Tensor& g_u, const Tensor& g_st) {
  const T *after = at<T>(u), *g = at<T>(g_u);
  T* to = at<T>(g_st);
  rows(p.count, p.d, [=] RESTAGE_DEVICE(int64_t pair, int64_t c) {
    const int64_t i = pair * p.d + c;
    to[2 * pair * p.d + c] = after[i] <= T(0) ? T(0) : g[i];
  });
}

template <class T>
void cloud_gradients(const NeighbourAttentionGradArgs& args, const Pairs<T>& p, int64_t first,
                     int64_t last, Tensor& g_wb) {
  const NeighbourAttentionInputs& in = args.in;
  const auto room = [&](int64_t width) { return empty_like(args.gy, {p.count, width}); };
  const int64_t at_point = first * p.v, d = p.d;
  const MatmulPrecision precision = in.precision;
  const auto add_product = [&](const Tensor& a, const Tensor& b, Tensor& sum) {  // sum += a^T b
    matmul({.a = a,
            .b = b,
            .out = sum,
            .transpose_a = true,
            .accumulate = true,
            .precision = precision});
  };
  const Tensor r = offsets(in, p), h = hidden(in, p, r);
  Tensor st = room(2 * d), g_st = room(2 * d), g_h = room(d);
  matmul({.a = h, .b = in.both, .out = st, .transpose_b = true, .precision = precision});
  const Tensor u = score_inputs(in, p, st);
  const Tensor g_e =
      score_gradients(p, at<T>(st), at<T>(args.weights) + at_point * p.k * d,
                      at<T>(args.y) + at_point * d, at<T>(args.gy) + at_point * d, g_st);
  add_product(g_e, u, args.out);
  matmul({.a = g_e, .b = in.gamma, .out = g_h, .precision = precision});  // for now it holds u
  keep_on(p, u, g_h, g_st);
  add_product(g_st, h, args.g_both);
  matmul({.a = g_st, .b = in.both, .out = g_h, .precision = precision});
  const T* after = at<T>(h);
  T* g = at<T>(g_h);
  each(p.count * d, [=] RESTAGE_DEVICE(int64_t i) {
    if (after[i] <= T(0)) g[i] = T(0);
  });
  add_product(g_h, r, g_wb);

  const Askers list = askers_of(in.index.rows(first, last), p.v);
  const AskersAt askers(list);
  sum_own(p, at<T>(g_st), {0, d, 2 * d}, at<T>(args.g_query) + at_point * d);
  sum_asked(p, askers, at<T>(g_st), {0, d, 2 * d}, 0, -1, at<T>(args.g_key) + at_point * d);
  sum_asked(p, askers, at<T>(g_st), {d, d, 2 * d}, 0, 1, at<T>(args.g_value) + at_point * d);
  if (args.g_xyz == nullptr) return;
  Tensor g_r = room(3);
  matmul({.a = g_h, .b = in.w, .out = g_r, .precision = precision});
  T* g_xyz = at<T>(args.g_xyz) + at_point * 3;
  sum_own(p, at<T>(g_r), {0, 3, 3}, g_xyz);
  sum_asked(p, askers, at<T>(g_r), {0, 3, 3}, 1, -1, g_xyz);
}

template <class T>
void attention_grad_of(const NeighbourAttentionGradArgs& args) {
  const int64_t d = args.out.size(0);
  Tensor g_wb = empty_like(args.gy, {d, 4});
  for (const Tensor* sum : {&g_wb, &args.g_both, &args.out}) {
    T* to = at<T>(*sum);
    each(sum->numel(), [=] RESTAGE_DEVICE(int64_t i) { to[i] = T(0); });
  }
  for_parts<T>(args.in, [&](const Pairs<T>& p, int64_t first, int64_t last) {
    cloud_gradients(args, p, first, last, g_wb);
  });
  const T* from = at<T>(g_wb);
  T *g_w = at<T>(args.g_w), *g_b = at<T>(args.g_b);
  each(4 * d, [=] RESTAGE_DEVICE(int64_t i) {
    if (i % 4 < 3)
      g_w[i / 4 * 3 + i % 4] = from[i];
    else
      g_b[i / 4] = from[i];
  });
}

}  // namespace

void neighbour_attention(const NeighbourAttentionArgs& args) {
  RESTAGE_FLOATS(args.out.dtype(), attention_of, args)
}
void neighbour_attention_grad(const NeighbourAttentionGradArgs& args) {
  RESTAGE_FLOATS(args.out.dtype(), attention_grad_of, args)
}

}  // namespace restage::cuda
