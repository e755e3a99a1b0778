#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "autograd/cpu/points.cpp"
#include <hwy/foreach_target.h>  // once per instruction set

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

#include "autograd/cpu/common.h"
#include "autograd/cpu/kernels.h"
#include "autograd/cpu/math-inl.h"
#include "autograd/cpu/targets.h"
#include "autograd/kernels/scratch.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {
namespace {

constexpr int64_t kPadding = 64 / sizeof(float);  // the widest vector

/// A cloud by coordinates, which may be read kPadding numbers beyond its end.
template <class T>
struct Cloud {
  Scratch<T> x, y, z;
  explicit Cloud(int64_t v)
      : x(static_cast<size_t>(v + kPadding)), y(x.size()), z(x.size()), size(v) {}
  void set(const T* points) {
    for (int64_t i = 0; i < size; ++i) {
      x[i] = points[3 * i];
      y[i] = points[3 * i + 1];
      z[i] = points[3 * i + 2];
    }
  }
  int64_t size;
};

/// The squared distances of points i, i + 1, ... from one place, as a vector.
template <class D, class T>
HWY_INLINE hn::Vec<D> squared_distance(D d, const Cloud<T>& c, int64_t i, const T* from) {
  const auto dx = hn::Sub(hn::LoadU(d, c.x.data() + i), hn::Set(d, from[0]));
  const auto dy = hn::Sub(hn::LoadU(d, c.y.data() + i), hn::Set(d, from[1]));
  const auto dz = hn::Sub(hn::LoadU(d, c.z.data() + i), hn::Set(d, from[2]));
  return hn::MulAdd(dz, dz, hn::MulAdd(dy, dy, hn::Mul(dx, dx)));
}

/// A bound that at least k of the distances do not exceed: the points are dealt into at least k
/// groups, and each group has a nearest point.
template <class T>
hn::Vec<hn::ScalableTag<T>> bound_of(const T* distance, int64_t v, int64_t k) {
  const hn::ScalableTag<T> d;
  const auto lanes = static_cast<int64_t>(hn::Lanes(d));
  const int64_t step = (k + lanes - 1) / lanes * lanes;
  auto bound = hn::Set(d, T(0));
  for (int64_t g = 0; g < step; g += lanes) {
    auto least = hn::Set(d, std::numeric_limits<T>::infinity());
    for (int64_t i = g; i < v; i += step) least = hn::Min(least, hn::LoadU(d, distance + i));
    bound = hn::Max(bound, least);
  }
  return hn::MaxOfLanes(d, bound);
}

/// Finds the k nearest points, nearest first; of equally near points the one of the lower index
/// comes first. A point with NaN is infinitely far.
template <class T>
void nearest(const T* query, const Cloud<T>& cloud, int64_t k, T* distance, T* best, int32_t* out) {
  const hn::ScalableTag<T> d;
  using V = hn::Vec<decltype(d)>;
  const auto lanes = static_cast<int64_t>(hn::Lanes(d));
  const V infinity = hn::Set(d, std::numeric_limits<T>::infinity());
  const int64_t v = cloud.size;
  for (int64_t i = 0; i < v; i += lanes) {
    const V far = squared_distance(d, cloud, i, query);
    hn::StoreU(hn::IfThenElse(hn::Eq(far, far), far, infinity), d, distance + i);
  }
  std::fill_n(distance + v, kPadding, std::numeric_limits<T>::infinity());
  const V bound = bound_of(distance, v, k);
  int64_t count = 0;
  const auto add = [&](int64_t i) {  // indices rise, so an equally near point goes behind
    const T far = distance[i];
    if (count == k && !(far < best[k - 1])) return;
    count = std::min(count + 1, k);
    int64_t at = count - 1;
    for (; at > 0 && far < best[at - 1]; --at) {
      best[at] = best[at - 1];
      out[at] = out[at - 1];
    }
    best[at] = far;
    out[at] = static_cast<int32_t>(i);
  };
  for (int64_t i = 0; i < v; i += lanes) {
    uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, hn::Le(hn::LoadU(d, distance + i), bound), bytes);
    uint64_t bits;
    std::memcpy(&bits, bytes, sizeof bits);
    for (; bits != 0; bits &= bits - 1) {
      const int64_t at = i + std::countr_zero(bits);
      if (at < v) add(at);
    }
  }
}

/// Lowers every best[i] to the squared distance from a place if that is less, and returns the first
/// index of the largest. Beyond the cloud `best` holds numbers below zero.
template <class T>
int64_t farthest_of(const Cloud<T>& cloud, const T* from, T* best) {
  const hn::ScalableTag<T> d;
  const hn::RebindToSigned<decltype(d)> di;
  using Index = hn::TFromD<decltype(di)>;
  const auto lanes = static_cast<int64_t>(hn::Lanes(d));
  auto top = hn::Set(d, T(-1));
  auto at = hn::Zero(di), here = hn::Iota(di, 0);
  for (int64_t i = 0; i < cloud.size; i += lanes) {
    const auto far = squared_distance(d, cloud, i, from);
    const auto old = hn::LoadU(d, best + i);
    const auto now = hn::IfThenElse(hn::Lt(far, old), far, old);
    hn::StoreU(now, d, best + i);
    const auto more = hn::Gt(now, top);
    top = hn::IfThenElse(more, now, top);
    at = hn::IfThenElse(hn::RebindMask(di, more), here, at);
    here = hn::Add(here, hn::Set(di, static_cast<Index>(lanes)));
  }
  HWY_ALIGN T value[HWY_MAX_BYTES / sizeof(T)];
  HWY_ALIGN Index index[HWY_MAX_BYTES / sizeof(T)];
  hn::Store(top, d, value);
  hn::Store(at, di, index);
  int64_t first = 0;  // lane
  for (int64_t j = 1; j < lanes; ++j)
    if (value[j] > value[first] || (value[j] == value[first] && index[j] < index[first])) first = j;
  return index[first];
}

/// Starts with the point farthest from the mean, then always the one farthest from all chosen.
template <class T>
void farthest(const T* x, Cloud<T>& cloud, Scratch<T>& distance, int64_t m, int32_t* out) {
  const int64_t v = cloud.size;
  cloud.set(x);
  T centre[3] = {0, 0, 0};
  for (int64_t i = 0; i < v; ++i)
    for (int c = 0; c < 3; ++c) centre[c] += x[3 * i + c];
  for (T& c : centre) c /= static_cast<T>(v);
  const auto reset = [&](T value) {
    std::fill_n(distance.begin(), v, value);
    std::fill_n(distance.begin() + v, kPadding, T(-1));
  };
  reset(std::numeric_limits<T>::infinity());
  int64_t current = farthest_of(cloud, centre, distance.data());
  reset(T(1e10));
  for (int64_t s = 0; s < m; ++s) {
    out[s] = static_cast<int32_t>(current);
    if (s + 1 < m) current = farthest_of(cloud, x + 3 * current, distance.data());
  }
}

/// Softmax over the k rows of score [k, d] times a scale, and the rows of value added with it.
template <class T>
void pool_rows(const T* score, const T* value, int64_t k, int64_t d, T scale, T* weights, T* out,
               T* top, T* total) {
  using V = hn::Vec<hn::ScalableTag<T>>;
  const V factor = hn::Set(hn::ScalableTag<T>(), scale);
  const V one = hn::Set(hn::ScalableTag<T>(), T(1));
  std::copy_n(score, d, top);
  for (int64_t j = 1; j < k; ++j)
    for (int64_t i = 0; i < d; ++i) top[i] = score[j * d + i] > top[i] ? score[j * d + i] : top[i];
  std::fill_n(total, d, T(0));
  std::fill_n(out, d, T(0));
  const auto exponential = [&](V& w, V& sum, V s, V t) HWY_ATTR {
    w = exp(hn::Mul(hn::Sub(s, t), factor));
    sum = hn::Add(sum, w);
  };
  for (int64_t j = 0; j < k; ++j)
    update(d, exponential, weights + j * d, total, score + j * d, static_cast<const T*>(top));
  map(
      d, total, [&](V t) HWY_ATTR { return hn::Div(one, t); }, total);
  const auto add = [](V& w, V& sum, V inverse, V v) HWY_ATTR {
    w = hn::Mul(w, inverse);
    sum = hn::MulAdd(w, v, sum);
  };
  for (int64_t j = 0; j < k; ++j)
    update(d, add, weights + j * d, out, static_cast<const T*>(total), value + j * d);
}

}  // namespace

void knn(const KnnArgs& args) {
  const int64_t m = args.query.size(1), v = args.points.size(1), k = args.out.size(2);
  if (k == 0) return;
  dispatch(args.points.dtype(), [&](auto zero) HWY_ATTR {
    using T = decltype(zero);
    parallel_for(args.query.size(0) * m, 64, [&](int64_t from, int64_t to) HWY_ATTR {
      Cloud<T> cloud(v);
      Scratch<T> distance(cloud.x.size()), best(static_cast<size_t>(k));
      for (int64_t q = from; q < to; ++q) {
        if (q == from || q % m == 0) cloud.set(args.points.data<T>() + q / m * v * 3);
        nearest(args.query.data<T>() + 3 * q, cloud, k, distance.data(), best.data(),
                args.out.data<int32_t>() + q * k);
      }
    });
  });
}

void fps(const FpsArgs& args) {
  const int64_t v = args.points.size(1), m = args.out.size(1);
  dispatch(args.points.dtype(), [&](auto zero) HWY_ATTR {
    using T = decltype(zero);
    parallel_for(args.points.size(0), 1, [&](int64_t from, int64_t to) HWY_ATTR {
      Cloud<T> cloud(v);
      Scratch<T> distance(cloud.x.size());
      for (int64_t s = from; s < to; ++s)
        farthest(args.points.data<T>() + s * v * 3, cloud, distance, m,
                 args.out.data<int32_t>() + s * m);
    });
  });
}

void attention_pool(const AttentionPoolArgs& args) {
  const int64_t k = args.score.size(1), d = args.score.size(2);
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR {
    using T = decltype(zero);
    parallel_for(args.score.size(0), row_grain(k * d), [&](int64_t from, int64_t to) HWY_ATTR {
      Scratch<T> top(static_cast<size_t>(d)), total(static_cast<size_t>(d));
      for (int64_t p = from; p < to; ++p)
        pool_rows(args.score.data<T>() + p * k * d, args.value.data<T>() + p * k * d, k, d,
                  static_cast<T>(args.scale), args.weights.data<T>() + p * k * d,
                  args.out.data<T>() + p * d, top.data(), total.data());
    });
  });
}

void attention_pool_grad(const AttentionPoolGradArgs& args) {
  const int64_t k = args.value.size(1), d = args.value.size(2);
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR {
    using T = decltype(zero);
    const T scale = static_cast<T>(args.scale);
    parallel_for(args.value.size(0), row_grain(k * d), [&](int64_t from, int64_t to) HWY_ATTR {
      for (int64_t p = from; p < to; ++p) {
        const T *y = args.y.data<T>() + p * d, *g = args.gy.data<T>() + p * d;
        for (int64_t j = 0; j < k; ++j) {
          const int64_t at = (p * k + j) * d;
          const T *w = args.weights.data<T>() + at, *v = args.value.data<T>() + at;
          T *g_value = args.out.data<T>() + at, *g_score = args.g_score.data<T>() + at;
          for (int64_t i = 0; i < d; ++i) g_value[i] = g[i] * w[i];
          for (int64_t i = 0; i < d; ++i) g_score[i] = scale * w[i] * g[i] * (v[i] - y[i]);
        }
      }
    });
  });
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace restage::cpu {
RESTAGE_KERNEL(knn, KnnArgs)
RESTAGE_KERNEL(fps, FpsArgs)
RESTAGE_KERNEL(attention_pool, AttentionPoolArgs)
RESTAGE_KERNEL(attention_pool_grad, AttentionPoolGradArgs)
}  // namespace restage::cpu
#endif
