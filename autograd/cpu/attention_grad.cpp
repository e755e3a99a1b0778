// Neighbour attention, backward. Everything of the size [pairs, d] but the softmax is computed
// again, tile by tile; with active units known that is cheap. Tiles go to a fixed number of groups,
// each with its own sums, which are added in order at the end: same bits for any number of threads.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "autograd/cpu/attention_grad.cpp"
#include <hwy/foreach_target.h>  // once per instruction set

#include "autograd/cpu/attention_split_grad-inl.h"
#include "autograd/cpu/flush.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {
namespace {

/// Through relu(query - key + s): du masks dh; sums for query and key; st becomes [du, ..].
template <class T>
void score_grad(const Backward<T>& b, int64_t t, const T* u, const T* gu, T* st,
                GroupSums<T>& sums) {
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

/// Takes the gradient of [s, t] to the gradients of M and of the moments, with the hidden columns
/// as its factor.
template <class T>
void both_grad(Backward<T>& b, int64_t t, const T* hidden, const T* g_st, GroupSums<T>& sums,
               TileMemory<T>& memory) {
  const Attention<T>& a = b.a;
  const std::vector<int32_t>& units = a.active[t];
  const int64_t pairs = a.tile_rows(t) * a.k, columns = a.columns(t), m = std::ssize(units),
                width = 2 * a.d;
  const T* left = pack_left<T>({hidden, 1, columns}, columns, pairs, memory.left);
  const T* right = pack_right<T>({g_st, width, 1}, pairs, width, memory.right);
  T* g = memory.more.at_least(columns * width);
  product(columns, width, pairs, left, right, g, width);
  for (int64_t i = 0; i < m; ++i) {
    T* row = sums.both_t.template data<T>() + units[i] * width;
    const T* from = g + i * width;
    for (int64_t c = 0; c < width; ++c) row[c] += from[c];
  }
  if (columns > m)
    std::copy_n(g + m * width, 4 * width, b.moments.template data<T>() + 4 * t * width);
}

/// Takes the gradient of [s, t] to the gradient of z of the active units, and to W, b and the
/// points.
template <class T>
void hidden_grad(const Backward<T>& b, int64_t t, const T* r, const T* hidden, const T* g_st,
                 GroupSums<T>& sums, TileMemory<T>& memory) {
  const Attention<T>& a = b.a;
  const std::vector<int32_t>& units = a.active[t];
  const int64_t pairs = a.tile_rows(t) * a.k, m = std::ssize(units), width = 2 * a.d;
  if (m == 0) return;
  const T* right = b.full_right.data();
  if (!a.full[t]) {
    T* chosen = memory.more.at_least(m * width);
    for (int64_t i = 0; i < m; ++i)
      std::copy_n(a.both_t.template data<T>() + units[i] * width, width, chosen + i * width);
    right = pack_right<T>({chosen, 1, width}, width, m, memory.right);
  }
  T* gz = memory.gz.at_least(pairs * m);
  product(pairs, m, width, pack_left<T>({g_st, width, 1}, pairs, width, memory.left), right, gz, m);
  unit_grad(a, t, r, hidden, gz, sums, memory);
}

/// Gradient of the points: through the active units (gz, as hidden_grad left it) and through the
/// units that are on (affine).
template <class T>
void xyz_grad(const Backward<T>& b, int64_t t, const T* gz, const T* g_st, GroupSums<T>& sums) {
  const Attention<T>& a = b.a;
  const int64_t width = 2 * a.d;
  const T* affine = a.affine.template data<T>() + 4 * t * width;
  const bool full = a.full[t];
  offset_grad(b, t, gz, sums, [&](int64_t pair, int64_t c) {
    return full ? T(0) : dot(width, g_st + pair * width, affine + c * width);
  });
}

/// A tile whose scores are products in full.
template <class T>
void full_tile_grad(Backward<T>& b, int64_t t, const T* r, const T* hidden, T* st, const T* u,
                    GroupSums<T>& sums, TileMemory<T>& memory) {
  const Attention<T>& a = b.a;
  const int64_t pairs = a.tile_rows(t) * a.k, d = a.d;
  T* e = memory.e.at_least(pairs * d);
  pool_grad(b, t, st, e, sums);
  product(d, d, pairs, pack_left<T>({u, 1, d}, d, pairs, memory.left),
          pack_right<T>({e, d, 1}, pairs, d, memory.right), sums.gamma_t.template data<T>(), d,
          true);
  T* gu = memory.more.at_least(pairs * d);
  product(pairs, d, d, pack_left<T>({e, d, 1}, pairs, d, memory.left), b.gamma_right.data(), gu, d);
  score_grad(b, t, u, gu, st, sums);
  both_grad(b, t, hidden, st, sums, memory);
  hidden_grad(b, t, r, hidden, st, sums, memory);
  if (b.args.g_xyz != nullptr) xyz_grad(b, t, memory.gz.data(), st, sums);
}

template <class T>
void tile_grad(Backward<T>& b, int64_t t, GroupSums<T>& sums) {
  TileMemory<T>& memory = TileMemory<T>::mine();
  const T* r = pair_offsets(b.a, t, memory.offsets);
  const T* hidden = hidden_columns(b.a, t, r, memory);
  T* st = pair_products(b.a, t, hidden, memory);
  const T* u = score_inputs(b.a, t, st, memory);
  if (split_scores(b.a, t, memory)) {
    split_tile_grad(b, t, r, hidden, st, u, sums, memory);
  } else {
    full_tile_grad(b, t, r, hidden, st, u, sums, memory);
  }
}

/// Adds the gradients through the units that are on, for all tiles at once: M gets on^T moments; W
/// and b get, for every unit, the moments times M of the tiles in which the unit is on.
template <class T>
void affine_grad(const Backward<T>& b, Tensor& g_both_t, Tensor& g_hidden) {
  const Attention<T>& a = b.a;
  const int64_t rows = 4 * a.tiles.tiles(), d = a.d;
  const Tensor moments = b.moments.reshape({rows, 2 * d});
  cpu::matmul(
      {a.on.reshape({rows, d}), moments, g_both_t, true, false, nullptr, Activation::none, true});
  Tensor through = empty_like(b.moments, {rows, d});
  cpu::matmul({moments, b.args.in.both, through});
  T* g = g_hidden.data<T>();
  parallel_for(d, 64, [&](int64_t from, int64_t to) HWY_ATTR {
    for (int64_t t = 0; t < a.tiles.tiles(); ++t) {
      if (a.full[t]) continue;
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
void add_groups(const std::vector<GroupSums<T>>& groups, Tensor GroupSums<T>::*part, int64_t row,
                Tensor& out) {
  T* to = out.data<T>();
  parallel_for(out.numel(), kGrain, [&](int64_t from, int64_t end) HWY_ATTR {
    std::fill(to + from, to + end, T(0));
    for (const GroupSums<T>& s : groups) {
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
  const auto empty = [&](const Shape& shape) { return empty_like(args.gy, shape); };
  Tensor both_t = empty({d, 2 * d}), hidden = empty({4, d}), gamma_t = empty({d, d});
  add_groups(b.groups, &GroupSums<T>::gamma_t, 0, gamma_t);
  add_groups(b.groups, &GroupSums<T>::both_t, 0, both_t);
  add_groups(b.groups, &GroupSums<T>::hidden, 0, hidden);
  affine_grad(b, both_t, hidden);
  transpose_matrix(gamma_t.data<T>(), d, d, args.out.template data<T>());
  transpose_matrix(both_t.data<T>(), d, 2 * d, args.g_both.template data<T>());
  const T* h = hidden.data<T>();
  T *g_w = args.g_w.template data<T>(), *g_b = args.g_b.template data<T>();
  for (int64_t u = 0; u < d; ++u) {
    for (int64_t c = 0; c < 3; ++c) g_w[3 * u + c] = h[c * d + u];
    g_b[u] = h[3 * d + u];
  }
}

template <class T>
void backward(const NeighbourAttentionGradArgs& args) {
  Backward<T> b(args);
  parallel_for(std::ssize(b.groups), 1, [&](int64_t from, int64_t to) HWY_ATTR {
    const FlushSubnormals flush;  // a softmax that is nearly 0 or 1 is full of subnormal numbers
    for (int64_t g = from; g < to; ++g) {
      GroupSums<T>& sums = b.groups[g];
      make_sums(b, sums);
      for (int64_t t = sums.from; t < sums.to; ++t) tile_grad(b, t, sums);
    }
  });
  weight_grads(b);
  add_groups(b.groups, &GroupSums<T>::key, b.a.d, args.g_key);
  add_groups(b.groups, &GroupSums<T>::value, b.a.d, args.g_value);
  if (args.g_xyz != nullptr) add_groups(b.groups, &GroupSums<T>::xyz, 3, *args.g_xyz);
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
