// Neighbourhoods: a thread a query, a group a cloud that is thinned out. Distances are the CPU's to
// the bit, so neighbours are the same.
#include "autograd/cuda/kernels.h"

namespace restage::cuda {
namespace {

template <class T>
RESTAGE_DEVICE T squared_distance(const T* a, const T* b) {
  const T x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return fma(z, z, fma(y, y, x * x));
}

/// Points come in order, so of equal ones the earlier stays before.
template <class T>
void knn_of(const KnnArgs& args) {
  const T *query = at<T>(args.query), *points = at<T>(args.points);
  int32_t* out = at<int32_t>(args.out);
  const int64_t m = args.query.size(1), v = args.points.size(1), k = args.out.size(2);
  Tensor room = empty_like(args.points, {args.query.size(0) * m, k});
  T* distance = at<T>(room);
  each(args.query.size(0) * m, [=] RESTAGE_DEVICE(int64_t q) {
    T* best = distance + q * k;
    int32_t* index = out + q * k;
    int64_t count = 0;
    for (int64_t i = 0; i < v; ++i) {
      T far = squared_distance(points + (q / m * v + i) * 3, query + 3 * q);
      if (far != far) far = INFINITY;
      if (count == k && !(far < best[k - 1])) continue;
      if (count < k) ++count;
      int64_t place = count - 1;
      for (; place > 0 && far < best[place - 1]; --place) {
        best[place] = best[place - 1];
        index[place] = index[place - 1];
      }
      best[place] = far;
      index[place] = static_cast<int32_t>(i);
    }
  });
}

template <class T>
void fps_of(const FpsArgs& args) {
  const T* points = at<T>(args.points);
  int32_t* out = at<int32_t>(args.out);
  const int64_t v = args.points.size(1), m = args.out.size(1);
  Tensor room = empty_like(args.points, {args.points.size(0), v + 3});
  T* rooms = at<T>(room);
  groups(args.points.size(0), [=] RESTAGE_DEVICE(const Group& g, int64_t s) {
    const T* x = points + s * v * 3;
    T *best = rooms + s * (v + 3), *centre = best + v;
    g.each(3, [&](int64_t c) {  // in order, as the CPU adds
      T total = 0;
      for (int64_t i = 0; i < v; ++i) total += x[3 * i + c];
      centre[c] = total / static_cast<T>(v);
    });
    const auto farthest = [&](const T* from, bool fresh, T start) {
      g.each(v, [&](int64_t i) {
        const T old = fresh ? start : best[i], far = squared_distance(x + 3 * i, from);
        best[i] = far < old ? far : old;
      });
      const auto far = [&](int64_t i) { return Largest<T>{best[i], static_cast<int32_t>(i)}; };
      return g.sum<Largest<T>>(v, far).index;
    };
    int32_t current = farthest(centre, true, static_cast<T>(INFINITY));
    for (int64_t k = 0; k < m; ++k) {
      g.each(1, [&](int64_t) { out[s * m + k] = current; });
      if (k + 1 < m) current = farthest(x + 3 * current, k == 0, static_cast<T>(1e10));
    }
  });
}

template <class T>
void attention_pool_of(const AttentionPoolArgs& args) {
  const T *score = at<T>(args.score), *value = at<T>(args.value),
          scale = static_cast<T>(args.scale);
  T *out = at<T>(args.out), *weights = at<T>(args.weights);
  const int64_t k = args.score.size(1), d = args.score.size(2);
  each(args.out.numel(), [=] RESTAGE_DEVICE(int64_t i) {
    const int64_t from = i / d * k * d + i % d;
    T top = score[from];
    for (int64_t j = 1; j < k; ++j)
      if (score[from + j * d] > top) top = score[from + j * d];
    T total = 0, sum = 0;
    for (int64_t j = 0; j < k; ++j) {
      const T e = exp((score[from + j * d] - top) * scale);
      weights[from + j * d] = e;
      total += e;
    }
    const T inverse = T(1) / total;
    for (int64_t j = 0; j < k; ++j) {
      const T w = weights[from + j * d] * inverse;
      weights[from + j * d] = w;
      sum = fma(w, value[from + j * d], sum);
    }
    out[i] = sum;
  });
}

template <class T>
void attention_pool_grad_of(const AttentionPoolGradArgs& args) {
  const T *value = at<T>(args.value), *weights = at<T>(args.weights), *y = at<T>(args.y),
          *gy = at<T>(args.gy), scale = static_cast<T>(args.scale);
  T *g_score = at<T>(args.g_score), *g_value = at<T>(args.out);
  const int64_t k = args.value.size(1), d = args.value.size(2);
  each(args.value.numel(), [=] RESTAGE_DEVICE(int64_t i) {
    const int64_t p = i / (k * d) * d + i % d;
    g_value[i] = gy[p] * weights[i];
    g_score[i] = scale * weights[i] * gy[p] * (value[i] - y[p]);
  });
}

}  // namespace

void knn(const KnnArgs& args) {
  if (args.out.numel() > 0) RESTAGE_FLOATS(args.points.dtype(), knn_of, args)
}
void fps(const FpsArgs& args) { RESTAGE_FLOATS(args.points.dtype(), fps_of, args) }
void attention_pool(const AttentionPoolArgs& args) {
  RESTAGE_FLOATS(args.out.dtype(), attention_pool_of, args)
}
void attention_pool_grad(const AttentionPoolGradArgs& args) {
  RESTAGE_FLOATS(args.out.dtype(), attention_pool_grad_of, args)
}

}  // namespace restage::cuda
