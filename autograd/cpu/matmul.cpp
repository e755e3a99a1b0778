// Packed, register-tiled matrix product. Output tiles go to threads; the sum over k stays in one
// thread and in one order. An operand that several tiles need is packed once for all of them, in
// parallel; an operand that a single tile needs is packed by that tile, in the cache where it is
// used.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "autograd/cpu/matmul.cpp"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>  // once per instruction set

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "autograd/cpu/buffer.h"
#include "autograd/cpu/common.h"
#include "autograd/cpu/gemm_tile-inl.h"
#include "autograd/cpu/kernels.h"
#include "autograd/cpu/matmul_sizes.h"
#include "autograd/cpu/targets.h"
#include "autograd/kernels/stats.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {
namespace {

constexpr int64_t kTileRows = 288;  // times kDepth: half of a small L2
constexpr int64_t kTileCols = 512;
constexpr int64_t kShared = 1 << 19;        // numbers of both operands packed at a time
constexpr int64_t kPage = 4096, kWays = 6;  // of a small L1
constexpr int64_t kSharedRows = 1024;  // if a has more rows than this, each tile packs its own rows
constexpr int64_t kPieces = 16;        // tiles wanted at least, to have some to share
constexpr int64_t kSmallest = 1 << 15;  // cycles, roughly, that a piece should take

int64_t round_up(int64_t n, int64_t step) { return (n + step - 1) / step * step; }

template <class T>
struct Product {
  Strided<T> a, b;
  T* out;
  int64_t m, n, k;
  const T* bias;
  Activation activation;
  bool accumulate;
  /// Whether this is a product of a few rows with weights [n, k] as they lie in memory, of which
  /// each number is needed once.
  bool thin() const { return m <= kThin && a.col == 1 && b.row == 1 && !accumulate; }
  /// Whether rows of a are read as they lie in memory. Packed are columns, and rows that would
  /// push each other out of the first cache: a multiple of a page from one to the next.
  bool rows_lie_well() const {
    return a.col == 1 && (kRows <= kWays || a.row * static_cast<int64_t>(sizeof(T)) % kPage != 0);
  }
};

/// Where a register tile stands: its block of k is the first, the last, or neither.
struct Place {
  int64_t row, col;
  bool first, last;
};

/// The new value of an element that holds c, from the sum x over a block of k: the first block
/// overwrites c (unless accumulating), later blocks add to c; after the last block come bias and
/// activation. NaN stays NaN.
template <class T, class V>
HWY_INLINE V finish(const Product<T>& p, const Place& at, V x, V c, V bias) {
  if (!at.first || p.accumulate) x += c;
  if (!at.last) return x;
  if (p.bias) x += bias;
  if (p.activation == Activation::relu) x = x <= V{} ? V{} : x;
  return x;
}

template <class T>
void finish_tile(const Product<T>& p, const Place& at, int64_t rows, const T* sums) {
  constexpr int cols = Simd<T>::cols;
  const int64_t width = std::min<int64_t>(cols, p.n - at.col);
  for (int64_t i = 0; i < rows; ++i) {
    T* c = p.out + (at.row + i) * p.n + at.col;
    for (int64_t j = 0; j < width; ++j)
      c[j] = finish(p, at, sums[i * cols + j], c[j], p.bias ? p.bias[at.col + j] : T(0));
  }
}

/// One register tile: sums over a block of k, then out. `row`: a is not packed, and its rows are so
/// many numbers apart; 0: packed.
template <class T, int Rows>
void register_tile(const Product<T>& p, const Place& at, int64_t k, const T* a, int64_t row,
                   const T* b) {
  using V = typename Simd<T>::Vector;
  constexpr int width = Simd<T>::width, cols = Simd<T>::cols;
  T* c = p.out + at.row * p.n + at.col;
  const T* bias = p.bias ? p.bias + at.col : nullptr;
  alignas(kVectorBytes) Sums<T, Rows> acc = {};
  for (int i = 0; i < Rows; ++i) hwy::Prefetch(c + i * p.n);
  if (row == 0) {
    sum<T, Rows, kRows>(k, a, b, acc);
  } else {
    sum_rows<T, Rows>(k, a, row, b, acc);
  }
  if (p.n - at.col >= cols) {
    const bool read = !at.first || p.accumulate;
#pragma GCC unroll 12
    for (int i = 0; i < Rows; ++i) {
#pragma GCC unroll 2
      for (int v = 0; v < kVectors; ++v) {
        V* to = reinterpret_cast<V*>(c + i * p.n + v * width);
        *to = finish(p, at, acc[i][v], read ? *to : V{},
                     bias ? *reinterpret_cast<const V*>(bias + v * width) : V{});
      }
    }
    return;
  }
  alignas(kVectorBytes) T tile[Rows * cols];
  std::memcpy(tile, acc, sizeof tile);
  finish_tile(p, at, Rows, tile);
}

/// Columns j0 to j1, a multiple of `cols`, for a few rows: nothing is packed.
template <class T>
void thin_tiles(const Product<T>& p, int64_t j0, int64_t j1) {
  constexpr int cols = Simd<T>::cols;
  alignas(kVectorBytes) T sums[kThin * cols];
  for (int64_t j = j0; j < j1; j += cols) {
    const Weights<T> b{&p.b.at(0, j), p.k};
    multiply_thin_rows<T>(p.m, p.a.data, b, j + cols < j1 ? b.from(cols) : b, sums);
    finish_tile(p, Place{0, j, true, true}, p.m, sums);
  }
}

/// register_tile for 1 to kRows rows.
template <class T, int... Less>
constexpr auto register_tiles(std::integer_sequence<int, Less...>) {
  return std::array{&register_tile<T, Less + 1>...};
}

/// Packs rows for register tiles that know how many rows they have: no padding.
template <class T>
void pack_rows(const Strided<T>& a, int64_t m, int64_t k, T* out) {
  const int64_t whole = m / kRows * kRows;
  pack_a(a, whole, k, out);
  out += whole * k;
  for (int64_t l = 0; l < k; ++l)
    for (int64_t i = 0; i < m - whole; ++i) out[l * kRows + i] = a.at(whole + i, l);
}

/// How a product is cut, by its shape alone.
struct Cut {
  bool share_a, share_b;
  int64_t depth;       // of k, packed at a time when operands are shared
  int64_t rows, cols;  // of a tile

  template <class T>
  static Cut of(const Product<T>& p, int64_t batch) {
    constexpr int64_t step = Simd<T>::cols;
    Cut c{batch == 1 && p.m <= kSharedRows && !p.thin() && !p.rows_lie_well(),
          batch == 1 && p.m > kTileRows, p.k, 0, 0};
    const int64_t wide = (c.share_a ? p.m : 0) + (c.share_b ? p.n : 0);
    if (wide * p.k > kShared) c.depth = std::max(kDepth, kShared / wide / kDepth * kDepth);
    // A multiply-add of a register tile takes 1/32 cycle, fetching and packing a number of b one.
    const int64_t cost = p.n * p.k * (32 + p.m) / 32;
    const int64_t pieces =
        std::clamp<int64_t>(cost / kSmallest, 1, std::max<int64_t>(1, kPieces / batch));
    int64_t row_tiles = (p.m + kTileRows - 1) / kTileRows;
    int64_t col_tiles = (p.n + kTileCols - 1) / kTileCols;
    while (row_tiles * col_tiles < pieces) {
      const bool cut_rows = c.share_b && p.m / row_tiles > 6 * kRows;
      if (cut_rows && p.m / row_tiles > p.n / col_tiles) {
        ++row_tiles;
      } else if (p.n / col_tiles > (c.share_b ? 8 : 1) * step) {
        ++col_tiles;
      } else if (cut_rows) {
        ++row_tiles;
      } else {
        break;
      }
    }
    c.rows = round_up((p.m + row_tiles - 1) / row_tiles, kRows);
    c.cols = round_up((p.n + col_tiles - 1) / col_tiles, step);
    return c;
  }
};

/// Operands of a stretch of k from `begin` to `end` packed in blocks of kDepth; null: not shared.
template <class T>
struct Packed {
  const T *a, *b;
  int64_t begin, end;
};

template <class T>
void tile(const Product<T>& p, const Packed<T>& packed, int64_t i0, int64_t i1, int64_t j0,
          int64_t j1) {
  static constexpr auto kernels = register_tiles<T>(std::make_integer_sequence<int, kRows>());
  constexpr int cols = Simd<T>::cols;
  const int64_t m = round_up(p.m, kRows), n = round_up(p.n, cols);
  const int64_t thin_end = p.thin() ? j0 + (j1 - j0) / cols * cols : j0;
  alignas(64) T own_b[kDepth * cols];
  thin_tiles(p, j0, thin_end);
  if (thin_end == j1) return;
  const int64_t row = !packed.a && p.rows_lie_well() ? p.a.row : 0;
  const Buffer<T> own_a(packed.a || row > 0 ? 0 : round_up(i1 - i0, kRows) * std::min(kDepth, p.k));
  for (int64_t l0 = packed.begin; l0 < packed.end; l0 += kDepth) {
    const int64_t l = std::min(kDepth, packed.end - l0), before = l0 - packed.begin;
    const auto at = [&](int64_t i, int64_t j) { return Place{i, j, l0 == 0, l0 + l == p.k}; };
    const T* a = packed.a  ? packed.a + before * m + i0 * l
                 : row > 0 ? &p.a.at(i0, l0)
                           : own_a.data();
    if (!packed.a && row == 0) pack_rows(p.a.from(i0, l0), i1 - i0, l, own_a.data());
    for (int64_t j = thin_end; j < j1; j += cols) {
      const T* b = packed.b ? packed.b + before * n + j * l : own_b;
      if (!packed.b) pack_b(p.b.from(l0, j), l, std::min<int64_t>(cols, j1 - j), own_b);
      for (int64_t i = i0; i < i1; i += kRows) {
        const int64_t rows = std::min<int64_t>(kRows, i1 - i);
        kernels[rows - 1](p, at(i, j), l, a + (i - i0) * (row > 0 ? row : l), row, b);
      }
    }
  }
}

/// Packs what is shared: pack(l0, l, from, to) for panels of every block of the stretch.
template <class F>
void pack_shared(int64_t begin, int64_t end, int64_t count, int64_t panel, const F& pack) {
  const int64_t blocks = (end - begin + kDepth - 1) / kDepth;
  const int64_t piece = round_up(std::max<int64_t>(1, kGrain * 4 / kDepth), panel);
  const int64_t pieces = (count + piece - 1) / piece;
  parallel_for(blocks * pieces, 1, [&](int64_t from, int64_t to) {
    for (int64_t t = from; t < to; ++t) {
      const int64_t l0 = begin + t / pieces * kDepth, at = t % pieces * piece;
      pack(l0, std::min(kDepth, end - l0), at, std::min(count, at + piece));
    }
  });
}

/// Computes tiles [from, to) of one product, or of one of a batch of equal shape.
template <class T>
void multiply_tiles(const Product<T>& p, const Cut& cut, const Packed<T>& packed, int64_t from,
                    int64_t to) {
  const int64_t col_tiles = (p.n + cut.cols - 1) / cut.cols;
  for (int64_t t = from; t < to; ++t) {
    const int64_t i = t / col_tiles * cut.rows, j = t % col_tiles * cut.cols;
    tile(p, packed, i, std::min(p.m, i + cut.rows), j, std::min(p.n, j + cut.cols));
  }
}

int64_t tiles_of(int64_t m, int64_t n, const Cut& cut) {
  return (m + cut.rows - 1) / cut.rows * ((n + cut.cols - 1) / cut.cols);
}

template <class T>
void single(const Product<T>& p, const Cut& cut) {
  constexpr int cols = Simd<T>::cols;
  const int64_t m = round_up(p.m, kRows), n = round_up(p.n, cols);
  const Buffer<T> a(cut.share_a ? m * cut.depth : 0), b(cut.share_b ? n * cut.depth : 0);
  for (int64_t begin = 0; begin < p.k; begin += cut.depth) {
    const int64_t end = std::min(p.k, begin + cut.depth);
    if (cut.share_a)
      pack_shared(begin, end, p.m, kRows, [&](int64_t l0, int64_t l, int64_t i0, int64_t i1) {
        pack_rows(p.a.from(i0, l0), i1 - i0, l, a.data() + (l0 - begin) * m + i0 * l);
      });
    if (cut.share_b)
      pack_shared(begin, end, p.n, cols, [&](int64_t l0, int64_t l, int64_t j0, int64_t j1) {
        pack_b(p.b.from(l0, j0), l, j1 - j0, b.data() + (l0 - begin) * n + j0 * l);
      });
    const Packed<T> packed{cut.share_a ? a.data() : nullptr, cut.share_b ? b.data() : nullptr,
                           begin, end};
    parallel_for(tiles_of(p.m, p.n, cut), 1,
                 [&](int64_t from, int64_t to) { multiply_tiles(p, cut, packed, from, to); });
  }
}

/// Nothing to add up: the product is zero.
template <class T>
void empty_sum(const Product<T>& p) {
  for (int64_t i = 0; i < p.m; ++i)
    for (int64_t j = 0; j < p.n; ++j) {
      T& c = p.out[i * p.n + j];
      c = finish(p, Place{i, j, true, true}, T(0), c, p.bias ? p.bias[j] : T(0));
    }
}

template <class T>
void run(const MatmulArgs& args, const MatmulSizes& s) {
  // One column times a matrix is one row times the transposed matrix: both lie alike in memory.
  const bool column = s.n == 1 && args.bias == nullptr;
  const int64_t batch = s.batch, m = column ? 1 : s.m, n = column ? s.m : s.n, k = s.k;
  if (m == 0 || n == 0 || batch == 0) return;
  const auto product = [&](int64_t i) {
    const Strided<T> a{args.a.data<T>() + i * s.a.step, s.a.row, s.a.col};
    const Strided<T> b{args.b.data<T>() + i * s.b.step, s.b.row, s.b.col};
    return Product<T>{column ? Strided<T>{b.data, b.col, b.row} : a,
                      column ? Strided<T>{a.data, a.col, a.row} : b,
                      args.out.data<T>() + i * m * n,
                      m,
                      n,
                      k,
                      args.bias ? args.bias->data<T>() : nullptr,
                      args.activation,
                      args.accumulate};
  };
  if (k == 0) {
    for (int64_t i = 0; i < batch; ++i) empty_sum(product(i));
    return;
  }
  count_flops(2.0 * static_cast<double>(batch * m * n * k));
  const Cut cut = Cut::of(product(0), batch);
  if (batch == 1) return single(product(0), cut);
  const int64_t tiles = tiles_of(m, n, cut);
  const int64_t grain = std::max<int64_t>(1, kSmallest * 32 / (cut.rows * cut.cols * k));
  parallel_for(batch * tiles, grain, [&](int64_t from, int64_t to) {
    for (int64_t t = from; t < to; ++t)
      multiply_tiles(product(t / tiles), cut, Packed<T>{nullptr, nullptr, 0, k}, t % tiles,
                     t % tiles + 1);
  });
}

}  // namespace

void matmul(const MatmulArgs& args) {
  const MatmulSizes sizes(args);
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR { run<decltype(zero)>(args, sizes); });
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace restage::cpu {
RESTAGE_KERNEL(matmul, MatmulArgs)
}  // namespace restage::cpu
#endif
