// Backward through a tile whose scores were split (attention_tile-inl.h): every product has either
// the columns that made the scores (some ninety) or the tile's neighbours (some fifty) on one side
// where the plain backward pass has all pairs and all units.
#if defined(RESTAGE_CPU_ATTENTION_SPLIT_GRAD_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef RESTAGE_CPU_ATTENTION_SPLIT_GRAD_INL_H
#undef RESTAGE_CPU_ATTENTION_SPLIT_GRAD_INL_H
#else
#define RESTAGE_CPU_ATTENTION_SPLIT_GRAD_INL_H
#endif

#include "autograd/cpu/attention_grad-inl.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {

/// Sizes of a split tile.
struct Split {
  int64_t pairs, d, active, on, columns, others;
  int64_t rows() const { return columns + others; }   // of on_rows()
  int64_t width() const { return active + columns; }  // of score_columns()
};

/// Rows `units` of G transposed, side by side: [units, d].
template <class T>
const T* gamma_rows(const Attention<T>& a, const std::vector<int32_t>& units, Buffer<T>& buffer) {
  T* out = buffer.at_least(std::ssize(units) * a.d);
  for (size_t i = 0; i < units.size(); ++i)
    std::copy_n(a.gamma_t.template data<T>() + units[i] * a.d, a.d,
                out + static_cast<int64_t>(i) * a.d);
  return out;
}

template <class T>
void add_row(const T* from, int64_t n, T* to) {
  for (int64_t i = 0; i < n; ++i) to[i] += from[i];
}

/// to[columns] += from
template <class T>
void add_chosen(const T* from, const std::vector<int32_t>& columns, T* to) {
  for (const int32_t c : columns) to[c] += *from++;
}

/// The gradient of G from that of the scores, e. Returns the sums of products of e with what the
/// units that are on see: a row for each hidden column and (negated) for each neighbour, [rows, d].
template <class T>
const T* gamma_grad(const Split& s, const T* columns, const T* rows, const T* e, GroupSums<T>& sums,
                    TileMemory<T>& memory) {
  const int64_t d = s.d;
  T* seen = memory.more.at_least((s.active + s.rows()) * d);
  product(s.width(), d, s.pairs,
          pack_left<T>({columns, 1, s.width()}, s.width(), s.pairs, memory.left),
          pack_right<T>({e, d, 1}, s.pairs, d, memory.right), seen, d);
  T* by_other = seen + s.width() * d;
  std::fill_n(by_other, s.others * d, T(0));
  for (int64_t p = 0; p < s.pairs; ++p) {
    T* HWY_RESTRICT to = by_other + memory.slot[p] * d;
    const T* HWY_RESTRICT from = e + p * d;
    for (int64_t c = 0; c < d; ++c) to[c] -= from[c];
  }
  T* g = sums.gamma_t.template data<T>();
  for (int64_t i = 0; i < s.active; ++i) add_row(seen + i * d, d, g + memory.active[i] * d);
  const T* on = seen + s.active * d;
  T* part = memory.chosen.at_least(s.on * d);
  product(s.on, d, s.rows(), pack_left<T>({rows, 1, s.on}, s.on, s.rows(), memory.left),
          pack_right<T>({on, d, 1}, s.rows(), d, memory.right), part, d);
  for (int64_t i = 0; i < s.on; ++i) add_row(part + i * d, d, g + memory.on[i] * d);
  return on;
}

/// a [count, d] times the columns `units` of G: [count, units].
template <class T>
void through_gamma(const Attention<T>& a, const T* left, int64_t count,
                   const std::vector<int32_t>& units, T* out, TileMemory<T>& memory) {
  const int64_t n = std::ssize(units);
  const T* chosen = gamma_rows(a, units, memory.chosen);
  product(count, n, a.d, pack_left<T>({left, a.d, 1}, count, a.d, memory.left),
          pack_right<T>({chosen, 1, a.d}, a.d, n, memory.right), out, n);
}

/// Adds the gradients of query and key. gu: the gradient of u of the active units, masked here; on:
/// the gradient of on_rows(). A unit that is on gives the query nothing, since its gradients over
/// the neighbours add up to zero.
template <class T>
void query_key_grad(const Backward<T>& b, int64_t t, const Split& s, const T* columns, T* gu,
                    const T* on, GroupSums<T>& sums, TileMemory<T>& memory) {
  const Attention<T>& a = b.a;
  const auto g_key = [&](int64_t row) {
    return sums.key.template data<T>() + (row - sums.first_row) * s.d;
  };
  for (int64_t p = 0; p < s.pairs; ++p)
    for (int64_t i = 0; i < s.active; ++i)
      gu[p * s.active + i] = columns[p * s.width() + i] <= T(0) ? T(0) : gu[p * s.active + i];
  T* total = memory.y.at_least(s.active);
  for (int64_t i = 0; i < a.tile_rows(t); ++i) {
    T* g_query = b.args.g_query.template data<T>() + a.point(t, i) * s.d;  // of this tile alone
    std::fill_n(g_query, s.d, T(0));
    std::fill_n(total, s.active, T(0));
    for (int64_t p = i * a.k; p < (i + 1) * a.k; ++p) {
      T* key = g_key(memory.others[memory.slot[p]]);
      const T* g = gu + p * s.active;
      add_row(g, s.active, total);
      for (int64_t c = 0; c < s.active; ++c) key[memory.active[c]] -= g[c];
    }
    add_chosen(total, memory.active, g_query);
  }
  for (int64_t j = 0; j < s.others; ++j)
    add_chosen(on + (s.columns + j) * s.on, memory.on, g_key(memory.others[j]));
}

/// The gradient of M and of the moments: hidden columns times the gradients of s (gu, on) and of t.
template <class T>
void split_both_grad(Backward<T>& b, int64_t t, const Split& s, const T* hidden, const T* gu,
                     const T* on, const T* g_st, GroupSums<T>& sums, TileMemory<T>& memory) {
  const Attention<T>& a = b.a;
  const std::vector<int32_t>& units = a.active[t];
  const int64_t d = s.d;
  const T* left = pack_left<T>({hidden, 1, s.columns}, s.columns, s.pairs, memory.left);
  T* of_s = memory.chosen.at_least(s.columns * (s.active + d));
  T* of_t = of_s + s.columns * s.active;
  product(s.columns, s.active, s.pairs, left,
          pack_right<T>({gu, s.active, 1}, s.pairs, s.active, memory.right), of_s, s.active);
  product(s.columns, d, s.pairs, left,
          pack_right<T>({g_st + d, 2 * d, 1}, s.pairs, d, memory.right), of_t, d);
  for (int64_t l = 0; l < s.columns; ++l) {
    T* row = l < std::ssize(units)
                 ? sums.both_t.template data<T>() + units[l] * 2 * d
                 : b.moments.template data<T>() + (4 * t + l - std::ssize(units)) * 2 * d;
    add_chosen(of_s + l * s.active, memory.active, row);
    add_chosen(on + l * s.on, memory.on, row);
    add_row(of_t + l * d, d, row + d);
  }
}

/// The gradient of z of the active units: through t, through the units of the scores that are on
/// (whose rows of scores are known), and through the active units of the scores.
template <class T>
T* split_hidden_grad(const Backward<T>& b, int64_t t, const Split& s, const T* on_scores,
                     const T* e, const T* gu, const T* g_st, TileMemory<T>& memory) {
  const Attention<T>& a = b.a;
  const std::vector<int32_t>& units = a.active[t];
  const int64_t m = std::ssize(units), d = s.d;
  T* gz = memory.gz.at_least(s.pairs * m);
  T* chosen = memory.chosen.at_least(m * (d + s.active));
  T* to = chosen + m * d;
  for (int64_t i = 0; i < m; ++i, to += s.active) {
    const T* row = a.both_t.template data<T>() + units[i] * 2 * d;
    std::copy_n(row + d, d, chosen + i * d);
    choose(row, memory.active, to);
  }
  product(s.pairs, m, d, pack_left<T>({g_st + d, 2 * d, 1}, s.pairs, d, memory.left),
          pack_right<T>({chosen, 1, d}, d, m, memory.right), gz, m);
  product(s.pairs, m, d, pack_left<T>({e, d, 1}, s.pairs, d, memory.left),
          pack_right<T>({on_scores, 1, d}, d, m, memory.right), gz, m, true);
  product(s.pairs, m, s.active, pack_left<T>({gu, s.active, 1}, s.pairs, s.active, memory.left),
          pack_right<T>({chosen + m * d, 1, s.active}, s.active, m, memory.right), gz, m, true);
  return gz;
}

/// The gradient of the points. Through hidden units that are on it comes by t, by the units of the
/// scores that are on, and by the active units of the scores.
template <class T>
void split_xyz_grad(const Backward<T>& b, int64_t t, const Split& s, const T* on_scores, const T* e,
                    const T* gu, const T* gz, const T* g_st, GroupSums<T>& sums,
                    const TileMemory<T>& memory) {
  const T* affine = b.a.affine.template data<T>() + 8 * t * s.d;
  Scratch<T> chosen(static_cast<size_t>(3 * s.active));
  for (int64_t c = 0; c < 3; ++c)
    choose(affine + c * 2 * s.d, memory.active, chosen.data() + c * s.active);
  offset_grad(b, t, gz, sums, [&](int64_t pair, int64_t c) {
    return dot(s.d, g_st + pair * 2 * s.d + s.d, affine + c * 2 * s.d + s.d) +
           dot(s.d, e + pair * s.d, on_scores + (s.columns - 4 + c) * s.d) +
           dot(s.active, gu + pair * s.active, chosen.data() + c * s.active);
  });
}

template <class T>
void split_tile_grad(Backward<T>& b, int64_t t, const T* r, const T* hidden, T* st, const T* u,
                     GroupSums<T>& sums, TileMemory<T>& memory) {
  const Attention<T>& a = b.a;
  find_others(a, t, memory);
  const Split s{a.tile_rows(t) * a.k,  a.d,          std::ssize(memory.active),
                std::ssize(memory.on), a.columns(t), std::ssize(memory.others)};
  const T* rows = on_rows(a, t, memory);
  const T* linear = on_scores(a, rows, s.columns, memory);
  const T* columns = score_columns(a, t, u, hidden, memory);
  T* e = memory.e.at_least(s.pairs * s.d);
  pool_grad(b, t, st, e, sums);
  const T* seen = gamma_grad(s, columns, rows, e, sums, memory);
  T* on = memory.u.at_least(s.rows() * s.on);  // u itself lives on in the columns
  through_gamma(a, seen, s.rows(), memory.on, on, memory);
  T* gu = memory.more.at_least(s.pairs * s.active);
  through_gamma(a, e, s.pairs, memory.active, gu, memory);
  query_key_grad(b, t, s, columns, gu, on, sums, memory);
  split_both_grad(b, t, s, hidden, gu, on, st, sums, memory);
  T* gz = split_hidden_grad(b, t, s, linear, e, gu, st, memory);
  unit_grad(a, t, r, hidden, gz, sums, memory);
  if (b.args.g_xyz != nullptr) split_xyz_grad(b, t, s, linear, e, gu, gz, st, sums, memory);
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per target
