// What the backward passes of the neighbour attention share.
#if defined(RESTAGE_CPU_ATTENTION_GRAD_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef RESTAGE_CPU_ATTENTION_GRAD_INL_H
#undef RESTAGE_CPU_ATTENTION_GRAD_INL_H
#else
#define RESTAGE_CPU_ATTENTION_GRAD_INL_H
#endif

#include "autograd/cpu/attention_tile-inl.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {

// The least (if there are enough tiles) and the largest number of groups of tiles that threads
// share. Each group has sums of its own: 3 MB at the paper's sizes, and the keys and values of its
// clouds.
inline constexpr int64_t kLeastGroups = 8, kMostGroups = 64;
inline constexpr int64_t kGroupTiles = 40;  // that repay the sums of a group

/// Tiles in each group but the last.
inline int64_t group_size(int64_t tiles) {
  const auto cut = [&](int64_t groups) { return (tiles + groups - 1) / groups; };
  return std::max(cut(kMostGroups), std::min(cut(kLeastGroups), kGroupTiles));
}

/// The sums of one group of tiles.
template <class T>
struct GroupSums {
  int64_t from = 0, to = 0;  // tiles
  int64_t first_row = 0;     // of the clouds that the group touches
  Tensor gamma_t, both_t, hidden, key, value, xyz;
};

template <class T>
struct Backward {
  Attention<T> a;
  const NeighbourAttentionGradArgs& args;
  Tensor moments;         // [tiles, 4, 2d]: sums over pairs of [r 1] times the gradient of [s t]
  Buffer<T> gamma_right;  // G for de G
  Buffer<T> full_right;   // M for the gradient of h, if a tile is done in full
  std::vector<GroupSums<T>> groups;

  explicit Backward(const NeighbourAttentionGradArgs& arguments)
      : a(arguments.in), args(arguments) {
    const Tensor& like = args.gy;
    moments = Tensor::zeros({a.tiles.tiles(), 4, 2 * a.d}, like.dtype(), like.device());
    pack_right<T>({args.in.gamma.template data<T>(), a.d, 1}, a.d, a.d, gamma_right);
    if (a.any_full)
      pack_right<T>({args.in.both.template data<T>(), a.d, 1}, 2 * a.d, a.d, full_right);
    const int64_t per_group = group_size(a.tiles.tiles());
    for (int64_t t = 0; t < a.tiles.tiles(); t += per_group) {
      GroupSums<T> s;
      s.from = t;
      s.to = std::min(a.tiles.tiles(), t + per_group);
      s.first_row = a.point(s.from, 0) / a.v * a.v;
      groups.push_back(s);
    }
  }
};

template <class T>
void make_sums(const Backward<T>& b, GroupSums<T>& s) {
  const int64_t d = b.a.d;
  const auto zeros = [&](const Shape& shape) {
    return Tensor::zeros(shape, b.args.gy.dtype(), b.args.gy.device());
  };
  const int64_t rows = (b.a.point(s.to - 1, 0) / b.a.v + 1) * b.a.v - s.first_row;
  s.gamma_t = zeros({d, d});
  s.both_t = zeros({d, 2 * d});
  s.hidden = zeros({4, d});
  s.key = zeros({rows, d});
  s.value = zeros({rows, d});
  if (b.args.g_xyz != nullptr) s.xyz = zeros({rows, 3});
}

/// e: the gradient of the scores; st: [s, t] becomes [.., gradient of t]. Also adds the gradient of
/// value.
template <class T>
void pool_grad(const Backward<T>& b, int64_t t, T* st, T* e, GroupSums<T>& sums) {
  const Attention<T>& a = b.a;
  const int64_t d = a.d;
  const auto scale = static_cast<T>(a.in.scale);
  for (int64_t i = 0; i < a.tile_rows(t); ++i) {
    const int64_t p = a.point(t, i);
    const T* HWY_RESTRICT y = b.args.y.template data<T>() + p * d;
    const T* HWY_RESTRICT gy = b.args.gy.template data<T>() + p * d;
    for (int64_t j = 0; j < a.k; ++j) {
      const int64_t pair = i * a.k + j, other = a.neighbour(p, j);
      const T* HWY_RESTRICT w = b.args.weights.template data<T>() + (p * a.k + j) * d;
      const T* HWY_RESTRICT value = a.value + other * d;
      T* HWY_RESTRICT g_value = sums.value.template data<T>() + (other - sums.first_row) * d;
      T* HWY_RESTRICT g_t = st + pair * 2 * d + d;
      T* HWY_RESTRICT g_e = e + pair * d;
      for (int64_t c = 0; c < d; ++c) {
        const T wg = w[c] * gy[c];
        g_e[c] = scale * wg * (value[c] + g_t[c] - y[c]);
        g_t[c] = wg;
        g_value[c] += wg;
      }
    }
  }
}

/// Masks the gradient gz [pairs, units] by the ReLU of the active units, and adds the gradients of
/// W and b.
template <class T>
void unit_grad(const Attention<T>& a, int64_t t, const T* r, const T* hidden, T* gz,
               GroupSums<T>& sums, TileMemory<T>& memory) {
  const std::vector<int32_t>& units = a.active[t];
  const int64_t pairs = a.tile_rows(t) * a.k, columns = a.columns(t), m = std::ssize(units);
  T* sum = memory.y.at_least(4 * m);
  std::fill_n(sum, 4 * m, T(0));
  for (int64_t p = 0; p < pairs; ++p) {
    const T* HWY_RESTRICT h = hidden + p * columns;
    const T x0 = r[4 * p], x1 = r[4 * p + 1], x2 = r[4 * p + 2];
    T* HWY_RESTRICT g = gz + p * m;
    T *HWY_RESTRICT s0 = sum, *HWY_RESTRICT s1 = sum + m, *HWY_RESTRICT s2 = sum + 2 * m,
                    *HWY_RESTRICT s3 = sum + 3 * m;
    for (int64_t i = 0; i < m; ++i) {
      g[i] = h[i] <= T(0) ? T(0) : g[i];
      s0[i] += g[i] * x0;
      s1[i] += g[i] * x1;
      s2[i] += g[i] * x2;
      s3[i] += g[i];
    }
  }
  T* total = sums.hidden.template data<T>();
  for (int64_t c = 0; c < 4; ++c)
    for (int64_t i = 0; i < m; ++i) total[c * a.d + units[i]] += sum[c * m + i];
}

template <class T>
T dot(int64_t n, const T* x, const T* y) {
  return sum_of(
      n, [](auto a, auto b) HWY_ATTR { return hn::Mul(a, b); }, x, y);
}

/// The gradient of the points from the gradient of the offsets of a tile's pairs: through the
/// active units (gz), and through the units that are on, for which on(pair, axis) gives it.
template <class T, class F>
void offset_grad(const Backward<T>& b, int64_t t, const T* gz, GroupSums<T>& sums, F&& on) {
  const Attention<T>& a = b.a;
  const std::vector<int32_t>& units = a.active[t];
  const int64_t m = std::ssize(units);
  const auto out = [&](int64_t row, int64_t c) -> T& {
    return sums.xyz.template data<T>()[3 * (row - sums.first_row) + c];
  };
  for (int64_t c = 0; c < 3; ++c) {
    Scratch<T> w(units.size());
    choose(a.hidden.template data<T>() + c * a.d, units, w.data());
    for (int64_t i = 0; i < a.tile_rows(t); ++i) {
      const int64_t p = a.point(t, i);
      for (int64_t j = 0; j < a.k; ++j) {
        const int64_t pair = i * a.k + j;
        const T g = dot(m, gz + pair * m, w.data()) + on(pair, c);
        out(p, c) += g;
        out(a.neighbour(p, j), c) -= g;
      }
    }
  }
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per target
