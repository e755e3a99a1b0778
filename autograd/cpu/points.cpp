#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "autograd/cpu/common.h"
#include "autograd/cpu/kernels.h"
#include "autograd/kernels/scratch.h"

namespace restage::cpu {
namespace {

template <class T>
T squared_distance(const T* a, const T* b) {
  const T x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return x * x + y * y + z * z;
}

/// First index of the largest value.
template <class T>
int64_t first_max(const Scratch<T>& values) {
  return std::max_element(values.begin(), values.end()) - values.begin();
}

template <class T>
void nearest(const T* query, const T* points, int64_t v, int64_t k, Scratch<T>& distance,
             Scratch<int32_t>& order, int32_t* out) {
  for (int64_t i = 0; i < v; ++i) {
    const T d = squared_distance(query, points + 3 * i);
    distance[static_cast<size_t>(i)] = d == d ? d : std::numeric_limits<T>::infinity();  // no NaN:
  }  // the order below must be one
  std::iota(order.begin(), order.end(), 0);
  const auto closer = [&](int32_t a, int32_t b) {
    const T da = distance[static_cast<size_t>(a)], db = distance[static_cast<size_t>(b)];
    return da < db || (da == db && a < b);
  };
  if (k < v) std::nth_element(order.begin(), order.begin() + k, order.end(), closer);
  std::sort(order.begin(), order.begin() + k, closer);
  std::copy_n(order.begin(), k, out);
}

template <class T>
void farthest(const T* x, int64_t v, int64_t m, int32_t* out) {
  T centre[3] = {0, 0, 0};
  for (int64_t i = 0; i < v; ++i)
    for (int c = 0; c < 3; ++c) centre[c] += x[3 * i + c];
  for (T& c : centre) c /= static_cast<T>(v);
  Scratch<T> distance(static_cast<size_t>(v));
  for (int64_t i = 0; i < v; ++i)
    distance[static_cast<size_t>(i)] = squared_distance(x + 3 * i, centre);
  int64_t current = first_max(distance);
  std::fill(distance.begin(), distance.end(), T(1e10));
  for (int64_t s = 0; s < m; ++s) {
    out[s] = static_cast<int32_t>(current);
    const T* at = x + 3 * current;
    for (int64_t i = 0; i < v; ++i) {
      const T d = squared_distance(x + 3 * i, at);
      T& best = distance[static_cast<size_t>(i)];
      best = d < best ? d : best;
    }
    current = first_max(distance);
  }
}

}  // namespace

void knn(const KnnArgs& args) {
  const int64_t m = args.query.size(1), v = args.points.size(1), k = args.out.size(2);
  dispatch(args.points.dtype(), [&](auto zero) {
    using T = decltype(zero);
    parallel_for(args.query.size(0) * m, 32, [&](int64_t from, int64_t to) {
      Scratch<T> distance(static_cast<size_t>(v));
      Scratch<int32_t> order(static_cast<size_t>(v));
      for (int64_t q = from; q < to; ++q)
        nearest(args.query.data<T>() + 3 * q, args.points.data<T>() + q / m * v * 3, v, k, distance,
                order, args.out.data<int32_t>() + q * k);
    });
  });
}

void fps(const FpsArgs& args) {
  const int64_t v = args.points.size(1), m = args.out.size(1);
  dispatch(args.points.dtype(), [&](auto zero) {
    using T = decltype(zero);
    parallel_for(args.points.size(0), 1, [&](int64_t from, int64_t to) {
      for (int64_t s = from; s < to; ++s)
        farthest(args.points.data<T>() + s * v * 3, v, m, args.out.data<int32_t>() + s * m);
    });
  });
}

void attention_pool(const AttentionPoolArgs& args) {
  const int64_t k = args.score.size(1), d = args.score.size(2);
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    const T scale = static_cast<T>(args.scale);
    parallel_for(args.score.size(0), row_grain(k * d), [&](int64_t from, int64_t to) {
      Eigen::Array<T, Eigen::Dynamic, 1> top(d), total(d);
      for (int64_t p = from; p < to; ++p) {
        const T* score = args.score.data<T>() + p * k * d;
        const T* value = args.value.data<T>() + p * k * d;
        T* weights = args.weights.data<T>() + p * k * d;
        MutableArray<T> out(args.out.data<T>() + p * d, d);
        top = ConstArray<T>(score, d);
        for (int64_t j = 1; j < k; ++j) top = top.max(ConstArray<T>(score + j * d, d));
        total.setZero();
        for (int64_t j = 0; j < k; ++j) {
          MutableArray<T> w(weights + j * d, d);
          w = ((ConstArray<T>(score + j * d, d) - top) * scale).exp();
          total += w;
        }
        total = T(1) / total;
        out.setZero();
        for (int64_t j = 0; j < k; ++j) {
          MutableArray<T> w(weights + j * d, d);
          w *= total;
          out += w * ConstArray<T>(value + j * d, d);
        }
      }
    });
  });
}

void attention_pool_grad(const AttentionPoolGradArgs& args) {
  const int64_t k = args.value.size(1), d = args.value.size(2);
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    const T scale = static_cast<T>(args.scale);
    parallel_for(args.value.size(0), row_grain(k * d), [&](int64_t from, int64_t to) {
      for (int64_t p = from; p < to; ++p) {
        const ConstArray<T> y(args.y.data<T>() + p * d, d), g(args.gy.data<T>() + p * d, d);
        for (int64_t j = 0; j < k; ++j) {
          const int64_t at = (p * k + j) * d;
          const ConstArray<T> w(args.weights.data<T>() + at, d), v(args.value.data<T>() + at, d);
          MutableArray<T>(args.out.data<T>() + at, d) = g * w;
          MutableArray<T>(args.g_score.data<T>() + at, d) = scale * w * g * (v - y);
        }
      }
    });
  });
}

}  // namespace restage::cpu
