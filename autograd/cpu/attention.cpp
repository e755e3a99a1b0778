// Neighbour attention, forward: tile by tile through all products, softmax and weighted sum, so
// that only the softmax, which the backward pass needs, leaves the cache as a tensor of the size
// [pairs, d].
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "autograd/cpu/attention.cpp"
#include <hwy/foreach_target.h>  // once per instruction set

#include "autograd/cpu/attention_tile-inl.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {
namespace {

/// The scores of a tile, [pairs, d], without the summands that are the same for all neighbours of a
/// point.
template <class T>
T* scores(const Attention<T>& a, int64_t t, const T* hidden, const T* u, const T* gamma,
          TileMemory<T>& memory) {
  const int64_t pairs = a.tile_rows(t) * a.k, d = a.d;
  T* e = memory.e.at_least(pairs * d);
  if (!split_scores(a, t, memory)) {
    count_score_units(d, d);
    product(pairs, d, d, pack_left<T>({u, d, 1}, pairs, d, memory.left), gamma, e, d);
    return e;
  }
  const int64_t m = std::ssize(memory.active), columns = a.columns(t), k = m + columns;
  count_score_units(m, d);
  find_others(a, t, memory);
  const T* linear =
      on_scores(a, on_rows(a, t, memory), columns + std::ssize(memory.others), memory);
  const T* left =
      pack_left<T>({score_columns(a, t, u, hidden, memory), k, 1}, pairs, k, memory.left);
  memory.rows.clear();
  for (const int32_t c : memory.active) memory.rows.push_back(a.gamma_t.template data<T>() + c * d);
  for (int64_t l = 0; l < columns; ++l) memory.rows.push_back(linear + l * d);
  product(pairs, d, k, left, pack_rows_right(memory.rows, d, memory.right), e, d);
  for (int64_t p = 0; p < pairs; ++p) {
    T* HWY_RESTRICT row = e + p * d;
    const T* HWY_RESTRICT key = linear + (columns + memory.slot[p]) * d;
    for (int64_t c = 0; c < d; ++c) row[c] -= key[c];
  }
  return e;
}

/// Softmax over the k rows of e (scaled, per channel) and the sum of its product with value + t.
/// e becomes the softmax. st: the rows [s, t] of the point's pairs.
template <class T>
void pool_point(const Attention<T>& a, int64_t point, T* e, const T* st, T* top, T* y) {
  const int64_t d = a.d;
  std::copy_n(e, d, top);
  for (int64_t j = 1; j < a.k; ++j)
    for (int64_t c = 0; c < d; ++c) top[c] = e[j * d + c] > top[c] ? e[j * d + c] : top[c];
  T* total = top + d;
  std::fill_n(total, d, T(0));
  const auto scale = static_cast<T>(a.in.scale);
  for (int64_t j = 0; j < a.k; ++j) {
    T* w = e + j * d;
    map(
        d, w,
        [scale](auto x, auto highest) HWY_ATTR {
          return exp(hn::Mul(hn::Sub(x, highest), hn::Set(hn::DFromV<decltype(x)>(), scale)));
        },
        w, top);
    for (int64_t c = 0; c < d; ++c) total[c] += w[c];
  }
  for (int64_t c = 0; c < d; ++c) total[c] = T(1) / total[c];
  std::fill_n(y, d, T(0));
  for (int64_t j = 0; j < a.k; ++j) {
    T* HWY_RESTRICT w = e + j * d;
    const T* HWY_RESTRICT value = a.value + a.neighbour(point, j) * d;
    const T* HWY_RESTRICT t = st + j * 2 * d + d;
    for (int64_t c = 0; c < d; ++c) {
      w[c] *= total[c];
      y[c] += w[c] * (value[c] + t[c]);
    }
  }
}

template <class T>
void forward(const NeighbourAttentionArgs& args) {
  const Attention<T> a(args.in);
  Buffer<T> gamma_buffer;
  const T* gamma = pack_right<T>({a.gamma_t.template data<T>(), a.d, 1}, a.d, a.d, gamma_buffer);
  parallel_for(a.tiles.tiles(), 1, [&](int64_t from, int64_t to) HWY_ATTR {
    TileMemory<T>& memory = TileMemory<T>::mine();
    for (int64_t t = from; t < to; ++t) {
      const T* r = pair_offsets(a, t, memory.offsets);
      const T* hidden = hidden_columns(a, t, r, memory);
      const T* st = pair_products(a, t, hidden, memory);
      T* e = scores(a, t, hidden, score_inputs(a, t, st, memory), gamma, memory);
      T* top = memory.y.at_least(2 * a.d);
      for (int64_t i = 0; i < a.tile_rows(t); ++i) {
        const int64_t p = a.point(t, i), row = i * a.k;
        pool_point(a, p, e + row * a.d, st + row * 2 * a.d, top, args.out.data<T>() + p * a.d);
        if (args.weights != nullptr)
          std::copy_n(e + row * a.d, a.k * a.d, args.weights->data<T>() + p * a.k * a.d);
      }
    }
  });
}

}  // namespace

void neighbour_attention(const NeighbourAttentionArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR { forward<decltype(zero)>(args); });
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace restage::cpu {
RESTAGE_KERNEL(neighbour_attention, NeighbourAttentionArgs)
}
#endif
