// Neighbour attention, backward. Everything of the size [pairs, d] but the softmax is computed
// again, tile by tile; with active units known that is cheap. Tiles go to a fixed number of groups,
// each with its own sums, which are added in order at the end: same bits for any number of threads.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "autograd/cpu/attention_grad.cpp"
#include <hwy/foreach_target.h>  // once per instruction set

#include "autograd/cpu/attention_tile-inl.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {
namespace {

constexpr int64_t kGroups = 8;

/// The sums of one group of tiles.
template <class T>
struct Sums {
  int64_t from = 0, to = 0;  // tiles
  int64_t first_row = 0;     // of the clouds that the group touches
  Tensor gamma, both_t, hidden, key, value, xyz;
};

template <class T>
struct Backward {
  Attention<T> a;
  const NeighbourAttentionGradArgs& args;
  Tensor moments;         // [tiles, 4, 2d]: sums over pairs of [r 1] times the gradient of [s t]
  Buffer<T> gamma_right;  // G for de G
  Buffer<T> full_right;   // M for the gradient of h, if a tile is done in full
  std::vector<Sums<T>> groups;

  explicit Backward(const NeighbourAttentionGradArgs& arguments)
      : a(arguments.in), args(arguments) {
    const Tensor& like = args.gy;
    moments = Tensor::zeros({a.tiles.tiles(), 4, 2 * a.d}, like.dtype(), like.device());
    pack_right<T>({args.in.gamma.template data<T>(), a.d, 1}, a.d, a.d, gamma_right);
    if (a.any_full)
      pack_right<T>({args.in.both.template data<T>(), a.d, 1}, 2 * a.d, a.d, full_right);
    const int64_t per_group = (a.tiles.tiles() + kGroups - 1) / kGroups;
    for (int64_t t = 0; t < a.tiles.tiles(); t += per_group) {
      Sums<T> s;
      s.from = t;
      s.to = std::min(a.tiles.tiles(), t + per_group);
      s.first_row = a.point(s.from, 0) / a.v * a.v;
      groups.push_back(s);
    }
  }
};

template <class T>
void make_sums(const Backward<T>& b, Sums<T>& s) {
  const int64_t d = b.a.d;
  const auto zeros = [&](const Shape& shape) {
    return Tensor::zeros(shape, b.args.gy.dtype(), b.args.gy.device());
  };
  const int64_t rows = (b.a.point(s.to - 1, 0) / b.a.v + 1) * b.a.v - s.first_row;
  s.gamma = zeros({d, d});
  s.both_t = zeros({d, 2 * d});
  s.hidden = zeros({4, d});
  s.key = zeros({rows, d});
  s.value = zeros({rows, d});
  if (b.args.g_xyz != nullptr) s.xyz = zeros({rows, 3});
}

/// e: gradient of the scores; st: [s, t] becomes [.., gradient of t]; also that of value.
template <class T>
void pool_grad(const Backward<T>& b, int64_t t, T* st, T* e, Sums<T>& sums) {
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

/// Through relu(query - key + s): du masks dh; sums for query and key; st becomes [du, ..].
template <class T>
void score_grad(const Backward<T>& b, int64_t t, const T* u, const T* gu, T* st, Sums<T>& sums) {
  const Attention<T>& a = b.a;
  const int64_t d = a.d;
  for (int64_t i = 0; i < a.tile_rows(t); ++i) {
    const int64_t p = a.point(t, i);
    T* HWY_RESTRICT g_query =
        b.args.g_query.template data<T>() + p * d;  // no other tile has this point
    std::fill_n(g_query, d, T(0));
    for (int64_t j = 0; j < a.k; ++j) {
      const int64_t pair = i * a.k + j;
      T* HWY_RESTRICT g_key =
          sums.key.template data<T>() + (a.neighbour(p, j) - sums.first_row) * d;
      const T* HWY_RESTRICT up = u + pair * d;
      const T* HWY_RESTRICT gp = gu + pair * d;
      T* HWY_RESTRICT g_s = st + pair * 2 * d;
      for (int64_t c = 0; c < d; ++c) {
        const T g = up[c] <= T(0) ? T(0) : gp[c];
        g_s[c] = g;
        g_query[c] += g;
        g_key[c] -= g;
      }
    }
  }
}

/// From the gradient of [s, t] to those of M and of the moments; the hidden columns are its factor.
template <class T>
void both_grad(Backward<T>& b, int64_t t, const T* hidden, const T* g_st, Sums<T>& sums,
               TileMemory<T>& memory) {
  const Attention<T>& a = b.a;
  const std::vector<int32_t>& units = a.active[static_cast<size_t>(t)];
  const int64_t pairs = a.tile_rows(t) * a.k, columns = a.columns(t), m = std::ssize(units),
                width = 2 * a.d;
  const T* left = pack_left<T>({hidden, 1, columns}, columns, pairs, memory.left);
  const T* right = pack_right<T>({g_st, width, 1}, pairs, width, memory.right);
  T* g = memory.more.at_least(columns * width);
  product(columns, width, pairs, left, right, g, width);
  for (int64_t i = 0; i < m; ++i) {
    T* row = sums.both_t.template data<T>() + units[static_cast<size_t>(i)] * width;
    const T* from = g + i * width;
    for (int64_t c = 0; c < width; ++c) row[c] += from[c];
  }
  if (columns > m)
    std::copy_n(g + m * width, 4 * width, b.moments.template data<T>() + 4 * t * width);
}

/// From the gradient of [s, t] to that of the active units' z, and to W, b and the points.
template <class T>
void hidden_grad(const Backward<T>& b, int64_t t, const T* r, const T* hidden, const T* g_st,
                 Sums<T>& sums, TileMemory<T>& memory) {
  const Attention<T>& a = b.a;
  const std::vector<int32_t>& units = a.active[static_cast<size_t>(t)];
  const int64_t pairs = a.tile_rows(t) * a.k, columns = a.columns(t), m = std::ssize(units),
                width = 2 * a.d;
  if (m == 0) return;
  const T* right = b.full_right.memory.data();
  if (!a.full[static_cast<size_t>(t)]) {
    T* chosen = memory.more.at_least(m * width);
    for (int64_t i = 0; i < m; ++i)
      std::copy_n(a.both_t.template data<T>() + units[static_cast<size_t>(i)] * width, width,
                  chosen + i * width);
    right = pack_right<T>({chosen, 1, width}, width, m, memory.right);
  }
  T* gz = memory.e.at_least(pairs * m);
  product(pairs, m, width, pack_left<T>({g_st, width, 1}, pairs, width, memory.left), right, gz, m);
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
    for (int64_t i = 0; i < m; ++i)
      total[c * a.d + units[static_cast<size_t>(i)]] += sum[c * m + i];
}

/// Gradient of the points: through the active units (gz, as hidden_grad left it) and those that are
/// on (affine).
template <class T>
void xyz_grad(const Backward<T>& b, int64_t t, const T* gz, const T* g_st, Sums<T>& sums) {
  const Attention<T>& a = b.a;
  const std::vector<int32_t>& units = a.active[static_cast<size_t>(t)];
  const int64_t m = std::ssize(units);
  const T *w = a.hidden.template data<T>(), *affine = a.affine.template data<T>() + 8 * t * a.d;
  const bool full = a.full[static_cast<size_t>(t)];
  for (int64_t i = 0; i < a.tile_rows(t); ++i) {
    const int64_t p = a.point(t, i);
    for (int64_t j = 0; j < a.k; ++j) {
      const int64_t pair = i * a.k + j;
      for (int c = 0; c < 3; ++c) {
        T g = 0;
        for (int64_t l = 0; l < m; ++l)
          g += gz[pair * m + l] * w[c * a.d + units[static_cast<size_t>(l)]];
        for (int64_t l = 0; l < 2 * a.d && !full; ++l)
          g += g_st[pair * 2 * a.d + l] * affine[c * 2 * a.d + l];
        T* out = sums.xyz.template data<T>() - 3 * sums.first_row + c;
        out[3 * p] += g;
        out[3 * a.neighbour(p, j)] -= g;
      }
    }
  }
}

template <class T>
void tile_grad(Backward<T>& b, int64_t t, Sums<T>& sums) {
  const Attention<T>& a = b.a;
  TileMemory<T>& memory = TileMemory<T>::mine();
  const int64_t pairs = a.tile_rows(t) * a.k, d = a.d;
  const T* r = pair_offsets(a, t, memory.offsets);
  const T* hidden = hidden_columns(a, t, r, memory);
  T* st = pair_products(a, t, hidden, memory);
  const T* u = score_inputs(a, t, st, memory);
  T* e = memory.e.at_least(pairs * d);
  pool_grad(b, t, st, e, sums);
  product(d, d, pairs, pack_left<T>({e, 1, d}, d, pairs, memory.left),
          pack_right<T>({u, d, 1}, pairs, d, memory.right), sums.gamma.template data<T>(), d, true);
  T* gu = memory.more.at_least(pairs * d);
  product(pairs, d, d, pack_left<T>({e, d, 1}, pairs, d, memory.left), b.gamma_right.memory.data(),
          gu, d);
  score_grad(b, t, u, gu, st, sums);
  both_grad(b, t, hidden, st, sums, memory);
  hidden_grad(b, t, r, hidden, st, sums, memory);
  if (b.args.g_xyz != nullptr) xyz_grad(b, t, memory.e.memory.data(), st, sums);
}

/// What the units that are on add, all tiles at once: M gets on^T moments; W and b get, for every
/// unit, the moments times M of the tiles in which it is on.
template <class T>
void affine_grad(const Backward<T>& b, Tensor& g_both_t, Tensor& g_hidden) {
  const Attention<T>& a = b.a;
  const int64_t rows = 4 * a.tiles.tiles(), d = a.d;
  const Tensor moments = b.moments.reshape({rows, 2 * d});
  cpu::matmul(
      {a.on.reshape({rows, d}), moments, g_both_t, true, false, nullptr, Activation::none, true});
  Tensor through = Tensor::empty({rows, d}, b.moments.dtype(), b.moments.device());
  cpu::matmul({moments, b.args.in.both, through});
  T* g = g_hidden.data<T>();
  parallel_for(d, 64, [&](int64_t from, int64_t to) HWY_ATTR {
    for (int64_t t = 0; t < a.tiles.tiles(); ++t) {
      if (a.full[static_cast<size_t>(t)]) continue;
      const uint8_t* sign = a.sign.data() + t * d;
      for (int64_t c = 0; c < 4; ++c) {
        const T* x = through.data<T>() + (4 * t + c) * d;
        for (int64_t u = from; u < to; ++u) g[c * d + u] += sign[u] == kOn ? x[u] : T(0);
      }
    }
  });
}

/// out = sum of a part over the groups, in order; `row` of out is where a group's part begins.
template <class T>
void add_groups(const std::vector<Sums<T>>& groups, Tensor Sums<T>::*part, int64_t row,
                Tensor& out) {
  T* to = out.data<T>();
  parallel_for(out.numel(), kGrain, [&](int64_t from, int64_t end) HWY_ATTR {
    std::fill(to + from, to + end, T(0));
    for (const Sums<T>& s : groups) {
      const int64_t shift = s.first_row * row;
      const T* x = (s.*part).template data<T>();
      const int64_t last = std::min(end, shift + (s.*part).numel());
      for (int64_t i = std::max(from, shift); i < last; ++i) to[i] += x[i - shift];
    }
  });
}

template <class T>
void weight_grads(Backward<T>& b) {
  const int64_t d = b.a.d;
  const auto& args = b.args;
  const auto empty = [&](const Shape& shape) {
    return Tensor::empty(shape, args.gy.dtype(), args.gy.device());
  };
  Tensor both_t = empty({d, 2 * d}), hidden = empty({4, d});
  add_groups(b.groups, &Sums<T>::gamma, 0, args.out);
  add_groups(b.groups, &Sums<T>::both_t, 0, both_t);
  add_groups(b.groups, &Sums<T>::hidden, 0, hidden);
  affine_grad(b, both_t, hidden);
  const T *m = both_t.data<T>(), *h = hidden.data<T>();
  T *g_both = args.g_both.template data<T>(), *g_w = args.g_w.template data<T>(),
    *g_b = args.g_b.template data<T>();
  constexpr int64_t block = 16;
  parallel_for(2 * d, block, [&](int64_t from, int64_t to) HWY_ATTR {
    for (int64_t u0 = 0; u0 < d; u0 += block)
      for (int64_t i = from; i < to; ++i)
        for (int64_t u = u0; u < std::min(d, u0 + block); ++u) g_both[i * d + u] = m[u * 2 * d + i];
  });
  for (int64_t u = 0; u < d; ++u) {
    for (int64_t c = 0; c < 3; ++c) g_w[3 * u + c] = h[c * d + u];
    g_b[u] = h[3 * d + u];
  }
}

template <class T>
void backward(const NeighbourAttentionGradArgs& args) {
  Backward<T> b(args);
  parallel_for(std::ssize(b.groups), 1, [&](int64_t from, int64_t to) HWY_ATTR {
    for (int64_t g = from; g < to; ++g) {
      Sums<T>& sums = b.groups[static_cast<size_t>(g)];
      make_sums(b, sums);
      for (int64_t t = sums.from; t < sums.to; ++t) tile_grad(b, t, sums);
    }
  });
  weight_grads(b);
  add_groups(b.groups, &Sums<T>::key, b.a.d, args.g_key);
  add_groups(b.groups, &Sums<T>::value, b.a.d, args.g_value);
  if (args.g_xyz != nullptr) add_groups(b.groups, &Sums<T>::xyz, 3, *args.g_xyz);
}

}  // namespace

void neighbour_attention_grad(const NeighbourAttentionGradArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR { backward<decltype(zero)>(args); });
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace restage::cpu {
RESTAGE_KERNEL(neighbour_attention_grad, NeighbourAttentionGradArgs)
}
#endif
