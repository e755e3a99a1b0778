// What the forward and the backward pass of the neighbour attention share. Points are handled in
// tiles of neighbours. Within a tile the offsets r hardly vary, so most hidden units of h = relu(W
// r + b) keep one sign: units that are off are zero, units that are on are affine in r, and only
// the other units, the active ones, need a product. With on/off/active known for a tile,
//   M h = [M_active, M_on W_on, M_on b_on] [relu(z_active); r; 1],
// which is exact and has a few dozen columns instead of d.
//
// The units of the second ReLU, u = query_i - key_j + s_ij, are split in the same way. Those that
// are on give the scores a part that is linear in what made u: the query's cancels in the softmax,
// the key's is one row for each neighbour of the tile, and s has few columns already:
//   G u = G_active relu(u_active) + (G_on M_on) [hidden columns] - (G_on key_on)_j + (same for all
//   j)
#if defined(RESTAGE_CPU_ATTENTION_TILE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef RESTAGE_CPU_ATTENTION_TILE_INL_H
#undef RESTAGE_CPU_ATTENTION_TILE_INL_H
#else
#define RESTAGE_CPU_ATTENTION_TILE_INL_H
#endif

#include "autograd/cpu/attention_tiles.h"
#include "autograd/cpu/common.h"
#include "autograd/cpu/kernels.h"
#include "autograd/cpu/math-inl.h"
#include "autograd/cpu/packed_product-inl.h"
#include "autograd/kernels/scratch.h"
#include "autograd/kernels/stats.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {

/// Pairs of a tile: whole register tiles, and in L2 with d = 512.
inline constexpr int64_t kTilePairs = 240;

enum Sign : uint8_t { kOff, kActive, kOn };

template <class T>
struct Attention {
  explicit Attention(const NeighbourAttentionInputs& inputs);

  const NeighbourAttentionInputs& in;
  int64_t n, v, k, d;
  const T *xyz, *query, *key, *value;
  const int32_t* index;
  PointTiles tiles;
  Tensor hidden;              // [4, d]: W transposed, then b
  Tensor both_t;              // M transposed, [d, 2d]
  Tensor gamma_t;             // G transposed, [d, d]
  std::vector<uint8_t> sign;  // [tiles, d]
  // The active units of each tile; all units of a tile that is done in full.
  std::vector<std::vector<int32_t>> active;
  std::vector<char> full;  // whether a tile is done in full
  bool any_full = false;
  /// Whether scores may be split: numbers that cancel or are left out must be finite, or a NaN
  /// would vanish.
  bool finite = false;
  Tensor on;             // [tiles, 4, d]: W and b of the units that are on
  Tensor affine;         // [tiles, 4, 2d]: on times M
  Buffer<T> full_right;  // both_t, packed, if a tile is done in full

  int64_t tile_rows(int64_t t) const {
    return tiles.start[static_cast<size_t>(t) + 1] - tiles.start[t];
  }
  int32_t point(int64_t t, int64_t i) const { return tiles.order[tiles.start[t] + i]; }
  /// Row of the neighbour j of a point (a row of the batch).
  int64_t neighbour(int64_t point_row, int64_t j) const {
    return point_row / v * v + index[point_row * k + j];
  }
  int64_t columns(int64_t t) const {
    const size_t i = static_cast<size_t>(t);
    return std::ssize(active[i]) + (full[i] ? 0 : 4);
  }

 private:
  void transpose_weights();
  void classify(int64_t t, Buffer<T>& offsets);
};

/// The working memory of one thread, kept between calls.
template <class T>
struct TileMemory {
  Buffer<T> offsets, weights, left, right, hidden, st, u, e, y, more;
  Buffer<T> range, columns, on_rows, on_scores, chosen, gz;
  std::vector<const T*> rows;
  std::vector<int32_t> active, on;  // units of the second ReLU
  std::vector<int64_t> others;      // rows of the batch: the neighbours in a tile, each once
  std::vector<int32_t> slot;        // for each pair the place of its neighbour in `others`
  std::vector<int32_t> place;       // for each row of the batch its place in `others`, or -1
  static TileMemory& mine() {
    thread_local TileMemory memory;
    return memory;
  }
};

/// out [columns, rows] = the transpose of m [rows, columns].
template <class T>
void transpose_matrix(const T* m, int64_t rows, int64_t columns, T* out) {
  constexpr int64_t block = 16;
  parallel_for(columns, block, [&](int64_t from, int64_t to) HWY_ATTR {
    for (int64_t r0 = 0; r0 < rows; r0 += block)
      for (int64_t u = from; u < to; ++u)
        for (int64_t r = r0; r < std::min(rows, r0 + block); ++r)
          out[u * rows + r] = m[r * columns + u];
  });
}

/// r and 1 of every pair of a tile, [pairs, 4].
template <class T>
T* pair_offsets(const Attention<T>& a, int64_t t, Buffer<T>& buffer) {
  T* r = buffer.at_least(a.tile_rows(t) * a.k * 4);
  T* to = r;
  for (int64_t i = 0; i < a.tile_rows(t); ++i) {
    const int64_t p = a.point(t, i);
    for (int64_t j = 0; j < a.k; ++j, to += 4) {
      const T* q = a.xyz + 3 * a.neighbour(p, j);
      for (int c = 0; c < 3; ++c) to[c] = a.xyz[3 * p + c] - q[c];
      to[3] = T(1);
    }
  }
  return r;
}

/// The signs of z = W r + b over a tile: lane by lane, one unit each.
template <class T>
void unit_signs(const T* hidden, int64_t d, const T* r, int64_t pairs, uint8_t* sign) {
  const hn::ScalableTag<T> tag;
  const auto lanes = static_cast<int64_t>(hn::Lanes(tag));
  const auto at = [&](int64_t u, T* lo, T* hi) HWY_ATTR {
    const auto w0 = hn::LoadU(tag, hidden + u), w1 = hn::LoadU(tag, hidden + d + u),
               w2 = hn::LoadU(tag, hidden + 2 * d + u), b = hn::LoadU(tag, hidden + 3 * d + u);
    auto low = hn::Set(tag, std::numeric_limits<T>::infinity()), high = hn::Neg(low);
    for (int64_t p = 0; p < pairs; ++p) {
      const T* x = r + 4 * p;
      const auto z =
          hn::MulAdd(w0, hn::Set(tag, x[0]),
                     hn::MulAdd(w1, hn::Set(tag, x[1]), hn::MulAdd(w2, hn::Set(tag, x[2]), b)));
      low = hn::Min(low, z);
      high = hn::Max(high, z);
    }
    hn::StoreU(low, tag, lo);
    hn::StoreU(high, tag, hi);
  };
  T lo[HWY_MAX_BYTES / sizeof(T)], hi[HWY_MAX_BYTES / sizeof(T)];
  for (int64_t u0 = 0; u0 < d; u0 += lanes) {
    const int64_t u = std::max<int64_t>(0, std::min(u0, d - lanes));
    if (d >= lanes) {
      at(u, lo, hi);
    } else {
      for (int64_t i = 0; i < d; ++i) {
        lo[i] = std::numeric_limits<T>::infinity();
        hi[i] = -lo[i];
        for (int64_t p = 0; p < pairs; ++p) {
          const T* x = r + 4 * p;
          const T z = hidden[i] * x[0] +
                      (hidden[d + i] * x[1] + (hidden[2 * d + i] * x[2] + hidden[3 * d + i]));
          lo[i] = z < lo[i] ? z : lo[i];
          hi[i] = z > hi[i] ? z : hi[i];
        }
      }
    }
    for (int64_t i = 0; i < std::min(lanes, d); ++i)
      sign[u + i] = lo[i] > T(0) ? kOn : hi[i] <= T(0) ? kOff : kActive;
  }
}

template <class T>
void Attention<T>::transpose_weights() {
  hidden = empty_like(in.w, {4, d});
  both_t = empty_like(in.w, {d, 2 * d});
  const T *w = in.w.data<T>(), *b = in.b.data<T>(), *m = in.both.data<T>();
  T *h = hidden.data<T>(), *mt = both_t.data<T>();
  for (int64_t u = 0; u < d; ++u) {
    for (int c = 0; c < 3; ++c) h[c * d + u] = w[3 * u + c];
    h[3 * d + u] = b[u];
  }
  transpose_matrix(m, 2 * d, d, mt);
  gamma_t = empty_like(in.w, {d, d});
  transpose_matrix(in.gamma.data<T>(), d, d, gamma_t.data<T>());
}

template <class T>
void Attention<T>::classify(int64_t t, Buffer<T>& offsets) {
  const size_t i = static_cast<size_t>(t);
  const T* r = pair_offsets(*this, t, offsets);
  uint8_t* s = sign.data() + t * d;
  unit_signs(hidden.data<T>(), d, r, tile_rows(t) * k, s);
  for (int64_t u = 0; u < d; ++u)
    if (s[u] == kActive) active[i].push_back(static_cast<int32_t>(u));
  // If more than this share of the units is active, leaving units out costs more than it saves.
  full[i] = in.dense || 10 * std::ssize(active[i]) > 7 * d;
  const T* h = hidden.data<T>();
  T* row = on.data<T>() + t * 4 * d;
  for (int64_t c = 0; c < 4; ++c)
    for (int64_t u = 0; u < d; ++u) row[c * d + u] = !full[i] && s[u] == kOn ? h[c * d + u] : T(0);
  if (!full[i]) return;
  active[i].resize(static_cast<size_t>(d));
  for (int64_t u = 0; u < d; ++u) active[i][u] = static_cast<int32_t>(u);
}

template <class T>
Attention<T>::Attention(const NeighbourAttentionInputs& inputs)
    : in(inputs),
      n(inputs.xyz.size(0)),
      v(inputs.xyz.size(1)),
      k(inputs.index.size(2)),
      d(inputs.query.size(2)),
      xyz(inputs.xyz.data<T>()),
      query(inputs.query.data<T>()),
      key(inputs.key.data<T>()),
      value(inputs.value.data<T>()),
      index(inputs.index.data<int32_t>()),
      tiles(tile_points(xyz, n, v, std::max<int64_t>(1, kTilePairs / std::max<int64_t>(k, 1)))),
      sign(static_cast<size_t>(tiles.tiles() * d)),
      active(static_cast<size_t>(tiles.tiles())),
      full(static_cast<size_t>(tiles.tiles())) {
  transpose_weights();
  finite = true;
  for (const Tensor* t : {&in.query, &in.key, &in.gamma}) {
    Tensor found = Tensor::empty({1}, DType::i32, t->device());
    cpu::non_finite({*t, found});
    finite = finite && found.data<int32_t>()[0] == 0;
  }
  on = empty_like(in.w, {tiles.tiles(), 4, d});
  affine = empty_like(in.w, {tiles.tiles(), 4, 2 * d});
  parallel_for(tiles.tiles(), 4, [&](int64_t from, int64_t to) HWY_ATTR {
    Buffer<T> offsets;
    for (int64_t t = from; t < to; ++t) classify(t, offsets);
  });
  Tensor flat = affine.reshape({4 * tiles.tiles(), 2 * d});
  cpu::matmul({on.reshape({4 * tiles.tiles(), d}), in.both, flat, false, true});
  int64_t units = 0;
  for (size_t t = 0; t < full.size(); ++t) {
    units += std::ssize(active[t]);
    any_full = any_full || full[t];
  }
  count_units(units, tiles.tiles() * d);
  if (any_full) pack_right<T>({both_t.template data<T>(), 2 * d, 1}, d, 2 * d, full_right);
}

/// relu(z) of the active units, then r and 1 unless the tile is done in full: [pairs, columns].
template <class T>
T* hidden_columns(const Attention<T>& a, int64_t t, const T* r, TileMemory<T>& memory) {
  const std::vector<int32_t>& units = a.active[t];
  const int64_t m = std::ssize(units), columns = a.columns(t), pairs = a.tile_rows(t) * a.k;
  T* w = memory.weights.at_least(4 * m);
  const T* all = a.hidden.template data<T>();
  for (int64_t c = 0; c < 4; ++c)
    for (int64_t i = 0; i < m; ++i) w[c * m + i] = all[c * a.d + units[i]];
  T* out = memory.hidden.at_least(pairs * columns);
  for (int64_t p = 0; p < pairs; ++p) {
    const T* x = r + 4 * p;
    T* HWY_RESTRICT row = out + p * columns;
    for (int64_t i = 0; i < m; ++i) {
      const T z = w[i] * x[0] + (w[m + i] * x[1] + (w[2 * m + i] * x[2] + w[3 * m + i]));
      row[i] = z <= T(0) ? T(0) : z;  // NaN stays
    }
    if (columns > m) std::copy_n(x, 4, row + m);
  }
  return out;
}

/// The rows of M transposed that belong to the hidden columns of a tile that is not done in full.
template <class T>
void column_rows(const Attention<T>& a, int64_t t, std::vector<const T*>* rows) {
  rows->clear();
  for (const int32_t u : a.active[t]) rows->push_back(a.both_t.template data<T>() + u * 2 * a.d);
  for (int64_t c = 0; c < 4; ++c)
    rows->push_back(a.affine.template data<T>() + (4 * t + c) * 2 * a.d);
}

/// [s, t] of every pair of a tile, [pairs, 2d], from its hidden columns.
template <class T>
T* pair_products(const Attention<T>& a, int64_t t, const T* hidden, TileMemory<T>& memory) {
  const int64_t pairs = a.tile_rows(t) * a.k, columns = a.columns(t);
  const T* left = pack_left<T>({hidden, columns, 1}, pairs, columns, memory.left);
  const T* right = a.full_right.data();
  if (!a.full[t]) {
    column_rows(a, t, &memory.rows);
    right = pack_rows_right(memory.rows, 2 * a.d, memory.right);
  }
  T* st = memory.st.at_least(pairs * 2 * a.d);
  product(pairs, 2 * a.d, columns, left, right, st, 2 * a.d);
  return st;
}

/// relu(query_i - key_j + s_ij), [pairs, d]; memory.range gets the least and the greatest value
/// before the ReLU of each unit, [2, d].
template <class T>
T* score_inputs(const Attention<T>& a, int64_t t, const T* st, TileMemory<T>& memory) {
  T* u = memory.u.at_least(a.tile_rows(t) * a.k * a.d);
  T* HWY_RESTRICT lo = memory.range.at_least(2 * a.d);
  T* HWY_RESTRICT hi = lo + a.d;
  std::fill_n(lo, a.d, std::numeric_limits<T>::infinity());
  std::fill_n(hi, a.d, -std::numeric_limits<T>::infinity());
  T* to = u;
  for (int64_t i = 0; i < a.tile_rows(t); ++i) {
    const int64_t p = a.point(t, i);
    const T* HWY_RESTRICT q = a.query + p * a.d;
    for (int64_t j = 0; j < a.k; ++j, to += a.d, st += 2 * a.d) {
      const T* HWY_RESTRICT key = a.key + a.neighbour(p, j) * a.d;
      T* HWY_RESTRICT out = to;
      for (int64_t c = 0; c < a.d; ++c) {
        const T x = q[c] - key[c] + st[c];
        lo[c] = x < lo[c] ? x : lo[c];
        hi[c] = x > hi[c] ? x : hi[c];
        out[c] = x <= T(0) ? T(0) : x;
      }
    }
  }
  return u;
}

/// Sorts the units of the second ReLU into memory.active and memory.on. False if the products are
/// cheaper in full.
template <class T>
bool split_scores(const Attention<T>& a, int64_t t, TileMemory<T>& memory) {
  memory.active.clear();
  memory.on.clear();
  if (a.full[t] || !a.finite) return false;
  const T *lo = memory.range.data(), *hi = lo + a.d;
  for (int64_t c = 0; c < a.d; ++c) {
    if (lo[c] > T(0)) {
      memory.on.push_back(static_cast<int32_t>(c));
    } else if (!(hi[c] <= T(0))) {
      memory.active.push_back(static_cast<int32_t>(c));
    }
  }
  return 2 * (std::ssize(memory.active) + a.columns(t)) < a.d;
}

/// Finds the neighbours of a tile: memory.others and memory.slot.
template <class T>
void find_others(const Attention<T>& a, int64_t t, TileMemory<T>& memory) {
  if (std::ssize(memory.place) < a.n * a.v) memory.place.resize(static_cast<size_t>(a.n * a.v), -1);
  memory.others.clear();
  memory.slot.clear();
  for (int64_t i = 0; i < a.tile_rows(t); ++i)
    for (int64_t j = 0; j < a.k; ++j) {
      const int64_t row = a.neighbour(a.point(t, i), j);
      int32_t& place = memory.place[row];
      if (place < 0) {
        place = static_cast<int32_t>(memory.others.size());
        memory.others.push_back(row);
      }
      memory.slot.push_back(place);
    }
  for (const int64_t row : memory.others) memory.place[row] = -1;
}

/// Copies the chosen columns of some rows.
template <class T>
void choose(const T* row, const std::vector<int32_t>& columns, T* out) {
  for (const int32_t c : columns) *out++ = row[c];
}

/// What the units that are on see: the rows of M for the hidden columns, then the keys of the
/// tile's neighbours, both at the units that are on. [columns + others, on].
template <class T>
T* on_rows(const Attention<T>& a, int64_t t, TileMemory<T>& memory) {
  const int64_t width = std::ssize(memory.on);
  T* out = memory.on_rows.at_least((a.columns(t) + std::ssize(memory.others)) * width);
  T* to = out;
  column_rows(a, t, &memory.rows);
  for (const T* row : memory.rows) choose(row, memory.on, to), to += width;
  for (const int64_t row : memory.others) choose(a.key + row * a.d, memory.on, to), to += width;
  return out;
}

/// The first `count` of on_rows() times G: their part of the scores, [count, d].
template <class T>
T* on_scores(const Attention<T>& a, const T* rows, int64_t count, TileMemory<T>& memory) {
  const int64_t width = std::ssize(memory.on);
  memory.rows.clear();
  for (const int32_t c : memory.on) memory.rows.push_back(a.gamma_t.template data<T>() + c * a.d);
  const T* right = pack_rows_right(memory.rows, a.d, memory.right);
  T* out = memory.on_scores.at_least(count * a.d);
  if (width == 0) std::fill_n(out, count * a.d, T(0));
  product(count, a.d, width, pack_left<T>({rows, width, 1}, count, width, memory.left), right, out,
          a.d);
  return out;
}

/// relu(u) of the active units beside the hidden columns, [pairs, active + columns].
template <class T>
T* score_columns(const Attention<T>& a, int64_t t, const T* u, const T* hidden,
                 TileMemory<T>& memory) {
  const int64_t pairs = a.tile_rows(t) * a.k, m = std::ssize(memory.active), columns = a.columns(t);
  T* out = memory.columns.at_least(pairs * (m + columns));
  T* to = out;
  for (int64_t p = 0; p < pairs; ++p, to += m + columns) {
    choose(u + p * a.d, memory.active, to);
    std::copy_n(hidden + p * columns, columns, to + m);
  }
  return out;
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per target
