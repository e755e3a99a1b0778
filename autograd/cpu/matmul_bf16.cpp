// Matrix product of operands rounded to bfloat16, summed in float32. Packed so that AMX can read
// it, and on every processor alike: without AMX vector instructions compute what its one
// instruction does, rounding by rounding.
//
// Packed operands: panels of 32 lines (rows of a, columns of b); in a panel steps of 32 terms (of
// k); in a step two tiles of 16 lines. A tile is 16 x 16 pairs of consecutive terms, the first in
// the lower half of 32 bits: of a [line, pair], of b [pair, line]. Zeros fill panels and steps up.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "autograd/cpu/matmul_bf16.cpp"
#include <hwy/foreach_target.h>  // once per instruction set

#include <algorithm>
#include <limits>
#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

#include "autograd/cpu/amx.h"
#include "autograd/cpu/common.h"
#include "autograd/cpu/gemm_tile-inl.h"
#include "autograd/cpu/kernels.h"
#include "autograd/cpu/matmul_sizes.h"
#include "autograd/cpu/targets.h"
#include "autograd/cpu/workspace.h"
#include "autograd/kernels/matmul_precision.h"
#include "autograd/kernels/stats.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {
namespace {

constexpr int64_t kLines = 32, kTerms = 32;            // of a panel, of a step
constexpr int64_t kTile = 16 * 16, kStep = 2 * kTile;  // pairs
constexpr int64_t kPass = 16;           // steps at a time: a panel of b and two tiles stay in L1
constexpr int64_t kTileRows = 128;      // of an output tile: its rows of a stay in L2
constexpr int64_t kShared = 1 << 20;    // numbers of both operands packed at a time
constexpr int64_t kPieces = 16;         // output tiles wanted at least, to have some to share
constexpr int64_t kSmallest = 1 << 20;  // multiply-adds that a tile should have at least

int64_t ceil_div(int64_t n, int64_t step) { return (n + step - 1) / step; }

/// One product. Operands as [line, term]: b stands transposed.
struct Product {
  Strided<float> a, b;
  float* out;
  int64_t m, n, k;
  const float* bias;
  Activation activation;
  bool accumulate;
};

/// The upper 16 bits are x in bfloat16: to nearest, ties to even; NaN becomes quiet and stays.
HWY_INLINE uint32_t rounded(float x) {
  const uint32_t bits = __builtin_bit_cast(uint32_t, x);
  const bool nan = (bits & 0x7fffffff) > 0x7f800000;
  return nan ? bits | 0x400000 : bits + 0x7fff + (bits >> 16 & 1);
}

HWY_INLINE uint32_t pair(float first, float second) {
  return rounded(first) >> 16 | (rounded(second) & 0xffff0000);
}

/// A tile of 16 lines and 32 terms: pairs [line, pair] from terms that lie side by side, [pair,
/// line] from lines that do.
HWY_INLINE void pack_terms(const float* in, int64_t line, uint32_t* out) {
  for (int64_t i = 0; i < 16; ++i, in += line, out += 16)
    for (int p = 0; p < 16; ++p) out[p] = pair(in[2 * p], in[2 * p + 1]);
}
HWY_INLINE void pack_lines(const float* in, int64_t term, uint32_t* out) {
  for (int64_t p = 0; p < 16; ++p, in += 2 * term, out += 16)
    for (int i = 0; i < 16; ++i) out[i] = pair(in[i], in[term + i]);
}

/// out [16, 16] = in [16, 16], transposed.
HWY_INLINE void turn(const uint32_t* in, uint32_t* out) {
#if HWY_TARGET != HWY_SCALAR
  constexpr int lanes = lanes_of<uint32_t>(16);
  for (int i = 0; i < 16; i += lanes)
    for (int l = 0; l < 16; l += 4) {
      const Transposed<lanes, uint32_t> t(in + i * 16 + l, 16);
      for (int e = 0; e < 4; ++e) hn::StoreU(t.v[e], t.d, out + (l + e) * 16 + i);
    }
#else
  for (int i = 0; i < 16; ++i)
    for (int l = 0; l < 16; ++l) out[l * 16 + i] = in[i * 16 + l];
#endif
}

/// A tile with `lines` and `terms` of its numbers, the rest zero. PairsFirst: as b is packed.
template <bool PairsFirst>
void pack_tile(const Strided<float>& x, int64_t lines, int64_t terms, uint32_t* out) {
  if (lines < 16 || terms < kTerms || (x.row != 1 && x.col != 1)) {
    float padded[16 * kTerms] = {};
    for (int64_t i = 0; i < std::min<int64_t>(lines, 16); ++i)
      for (int64_t l = 0; l < std::min(terms, kTerms); ++l) padded[i * kTerms + l] = x.at(i, l);
    return pack_tile<PairsFirst>({padded, kTerms, 1}, 16, kTerms, out);
  }
  const bool pairs_first = x.col != 1;
  alignas(64) uint32_t turned[kTile];
  uint32_t* to = pairs_first == PairsFirst ? out : turned;
  if (pairs_first) {
    pack_lines(x.data, x.col, to);
  } else {
    pack_terms(x.data, x.row, to);
  }
  if (to == turned) turn(turned, out);
}

/// A step of a panel.
template <bool PairsFirst>
void pack_step(const Strided<float>& x, int64_t lines, int64_t terms, uint32_t* out) {
  for (int64_t half = 0; half < 2; ++half)
    pack_tile<PairsFirst>(x.from(16 * half, 0), std::max<int64_t>(0, lines - 16 * half), terms,
                          out + half * kTile);
}

/// Subnormal numbers are zero, as operands and as results: AMX knows none.
class NoSubnormals {
 public:
#if defined(__x86_64__)
  NoSubnormals() : before_(_mm_getcsr()) { _mm_setcsr(before_ | 0x8040); }
  ~NoSubnormals() { _mm_setcsr(before_); }

 private:
  unsigned before_;
#else
  NoSubnormals() {}
  ~NoSubnormals() {}
#endif
};

/// sums [Rows, 2 vectors] of 32 columns += what AMX adds: for each step one chain of multiply-adds
/// over the first terms of the pairs and one over the second, and then their sum.
template <int Rows>
HWY_INLINE void chains(int64_t steps, const uint32_t* a, const uint32_t* b, int64_t column,
                       float* sums) {
  using V = Simd<float>::Vector;
  using U = Simd<uint32_t>::Vector;
  constexpr int width = Simd<float>::width;
  const auto start = [&](int v) {
    const int64_t c = column + v * width;
    return c / 16 * kTile + c % 16;
  };
  for (int64_t s = 0; s < steps; ++s, a += kStep, b += kStep) {
    V first[Rows][kVectors] = {}, second[Rows][kVectors] = {};
    for (int p = 0; p < 16; ++p) {
      V b_first[kVectors], b_second[kVectors];
#pragma GCC unroll 2
      for (int v = 0; v < kVectors; ++v) {
        const U pairs = *reinterpret_cast<const U*>(b + start(v) + p * 16);
        b_first[v] = reinterpret_cast<V>(pairs << 16);
        b_second[v] = reinterpret_cast<V>(pairs & 0xffff0000);
      }
#pragma GCC unroll 4
      for (int i = 0; i < Rows; ++i) {
        const U pairs = U{} + a[i * 16 + p];
        const V a_first = reinterpret_cast<V>(pairs << 16);
        const V a_second = reinterpret_cast<V>(pairs & 0xffff0000);
#pragma GCC unroll 2
        for (int v = 0; v < kVectors; ++v) {
          first[i][v] += a_first * b_first[v];
          second[i][v] += a_second * b_second[v];
        }
      }
    }
#pragma GCC unroll 4
    for (int i = 0; i < Rows; ++i)
#pragma GCC unroll 2
      for (int v = 0; v < kVectors; ++v)
        *reinterpret_cast<V*>(sums + i * kLines + v * width) += first[i][v] + second[i][v];
  }
}

/// amx_multiply() for the first rows and columns. Not inlined: the mode of NoSubnormals holds for
/// calls, which the compiler keeps in their place.
HWY_NOINLINE void vector_multiply(int64_t steps, const uint32_t* a, const uint32_t* b, int64_t rows,
                                  int64_t cols, bool add, float* sums) {
#if HWY_TARGET == HWY_AVX3
  constexpr int64_t tall = 4;
#else
  constexpr int64_t tall = 2;
#endif
  if (!add) std::fill_n(sums, kLines * kLines, 0.0f);
  for (int64_t j = 0; j < cols; j += Simd<float>::cols)
    for (int64_t i = 0; i < rows; i += tall)
      chains<tall>(steps, a + i / 16 * kTile + i % 16 * 16, b, j, sums + i * kLines + j);
}

/// A block of out, at most 32 x 32, and its sums.
struct Block {
  const Product& p;
  int64_t i, j, rows, cols;
  alignas(64) float sums[kLines * kLines];

  Block(const Product& product, int64_t row, int64_t col)
      : p(product),
        i(row),
        j(col),
        rows(std::min(kLines, p.m - row)),
        cols(std::min(kLines, p.n - col)) {}
  float* out(int64_t row) const { return p.out + (i + row) * p.n + j; }

  /// The sums of some steps, added to those before (in out) if `add`.
  void multiply(int64_t steps, const uint32_t* a, const uint32_t* b, bool add, bool amx) {
    for (int64_t r = 0; r < rows; ++r) {
      __builtin_prefetch(out(r), 1);
      __builtin_prefetch(out(r) + cols - 1, 1);
    }
    if (add && (rows < kLines || cols < kLines)) std::fill_n(sums, kLines * kLines, 0.0f);
    for (int64_t r = 0; add && r < rows; ++r) std::copy_n(out(r), cols, sums + r * kLines);
    if (amx) return amx_multiply(steps, a, b, add, sums);
    const NoSubnormals mode;
    vector_multiply(steps, a, b, rows, cols, add, sums);
  }

  /// Sums that are complete get bias and activation. NaN stays; of its many kinds always the same.
  void store(bool complete) const {
    const float* bias = complete && p.bias ? p.bias + j : nullptr;
    const bool relu = complete && p.activation == Activation::relu;
    using V = Simd<float>::Vector;
    constexpr int64_t width = Simd<float>::width;
    for (int64_t r = 0; r < rows; ++r) {
      const float* from = sums + r * kLines;
      float* to = out(r);
      int64_t c = 0;
      for (; c + width <= cols; c += width)
        *reinterpret_cast<V*>(to + c) =
            finished(*reinterpret_cast<const V*>(from + c), bias != nullptr,
                     bias ? *reinterpret_cast<const V*>(bias + c) : V{}, relu);
      for (; c < cols; ++c) to[c] = finished(from[c], bias != nullptr, bias ? bias[c] : 0, relu);
    }
  }
  template <class V>
  static HWY_INLINE V finished(V x, bool add_bias, V bias, bool relu) {
    if (add_bias) x += bias;
    if (relu) x = x <= V{} ? V{} : x;
    return x == x ? x : V{} + std::numeric_limits<float>::quiet_NaN();
  }
};

/// Packed panels of the steps from `begin` to `end`: a's from some row on, b's from some column on.
struct Stretch {
  const uint32_t *a, *b;
  int64_t begin, end;
};

/// The tile of out from (i0, j0) to (i1, j1). The sums of an element go on where the stretch before
/// left them in out, so its order is the same however k is cut.
void multiply_tile(const Product& p, const Stretch& s, int64_t i0, int64_t i1, int64_t j0,
                   int64_t j1) {
  const bool amx = matrix_unit();
  const AmxScope scope(amx);
  const int64_t steps = s.end - s.begin, all = ceil_div(p.k, kTerms) - s.begin;
  for (int64_t from = 0; from < steps; from += kPass) {
    const int64_t count = std::min(kPass, steps - from);
    for (int64_t j = j0; j < j1; j += kLines)
      for (int64_t i = i0; i < i1; i += kLines) {
        Block block(p, i, j);
        block.multiply(count, s.a + ((i - i0) / kLines * steps + from) * kStep,
                       s.b + ((j - j0) / kLines * steps + from) * kStep,
                       s.begin + from > 0 || p.accumulate, amx);
        block.store(from + count == all);
      }
  }
}

/// parallel_for, or one of the products of a batch in one thread.
template <class F>
void for_each(bool parallel, int64_t n, const F& f) {
  const auto pieces = [&](int64_t from, int64_t to) {
    for (int64_t t = from; t < to; ++t) f(t);
  };
  if (parallel) return parallel_for(n, 1, pieces);
  pieces(0, n);
}

/// All panels of an operand with `lines` lines, in pieces that read it as it lies in memory.
template <bool PairsFirst>
void pack_operand(const Strided<float>& x, int64_t lines, int64_t k, int64_t begin, int64_t end,
                  bool parallel, uint32_t* out) {
  const int64_t tall = x.row == 1 ? kPass : 1, deep = x.row == 1 ? 1 : kPass;  // of a piece
  const int64_t panels = ceil_div(lines, kLines), columns = ceil_div(panels, tall);
  for_each(parallel, ceil_div(end - begin, deep) * columns, [&](int64_t t) {
    const int64_t step = begin + t / columns * deep, panel = t % columns * tall;
    for (int64_t s = step; s < std::min(end, step + deep); ++s)
      for (int64_t i = panel; i < std::min(panels, panel + tall); ++i)
        pack_step<PairsFirst>(x.from(i * kLines, s * kTerms), lines - i * kLines, k - s * kTerms,
                              out + (i * (end - begin) + s - begin) * kStep);
  });
}

/// How a product is cut, by its shape alone.
struct Cut {
  int64_t rows, cols, steps;  // of a tile, of a stretch
  bool share_a;               // packed for all tiles; else by the tile that needs it
  explicit Cut(const Product& p) {
    const int64_t row_tiles = ceil_div(p.m, kTileRows), panels = ceil_div(p.n, kLines);
    const int64_t wanted = std::clamp<int64_t>(p.m * p.n * p.k / kSmallest, 1, kPieces);
    const int64_t col_tiles = std::clamp<int64_t>(wanted / row_tiles, 1, panels);
    rows = kTileRows;
    cols = ceil_div(panels, col_tiles) * kLines;
    share_a = col_tiles > 1;
    const int64_t wide = panels * kLines + (share_a ? ceil_div(p.m, kLines) * kLines : 0);
    steps =
        std::min(ceil_div(p.k, kTerms), std::max(kPass, kShared / wide / (kPass * kTerms) * kPass));
  }
};

void multiply(const Product& p, bool parallel) {
  const Cut cut(p);
  const int64_t steps = ceil_div(p.k, kTerms), col_tiles = ceil_div(p.n, cut.cols);
  const auto room = [&](int64_t lines) { return ceil_div(lines, kLines) * cut.steps * kStep; };
  const Workspace<uint32_t> a(cut.share_a ? room(p.m) : 0), b(room(p.n));
  for (int64_t begin = 0; begin < steps; begin += cut.steps) {
    const int64_t end = std::min(steps, begin + cut.steps), panel = (end - begin) * kStep;
    pack_operand<true>(p.b, p.n, p.k, begin, end, parallel, b.data());
    if (cut.share_a) pack_operand<false>(p.a, p.m, p.k, begin, end, parallel, a.data());
    for_each(parallel, ceil_div(p.m, cut.rows) * col_tiles, [&](int64_t t) {
      const int64_t i0 = t / col_tiles * cut.rows, j0 = t % col_tiles * cut.cols;
      const int64_t i1 = std::min(p.m, i0 + cut.rows), j1 = std::min(p.n, j0 + cut.cols);
      const Workspace<uint32_t> own(cut.share_a ? 0 : room(i1 - i0));
      if (!cut.share_a)
        pack_operand<false>(p.a.from(i0, 0), i1 - i0, p.k, begin, end, false, own.data());
      const uint32_t* left = cut.share_a ? a.data() + i0 / kLines * panel : own.data();
      multiply_tile(p, {left, b.data() + j0 / kLines * panel, begin, end}, i0, i1, j0, j1);
    });
  }
}

}  // namespace

void matmul_bf16(const MatmulArgs& args) {
  const MatmulSizes s(args);
  if (s.m == 0 || s.n == 0 || s.batch == 0) return;
  count_flops(2.0 * static_cast<double>(s.batch * s.m * s.n * s.k));
  for_each(s.batch > 1, s.batch, [&](int64_t i) {
    multiply(Product{{args.a.data<float>() + i * s.a.step, s.a.row, s.a.col},
                     {args.b.data<float>() + i * s.b.step, s.b.col, s.b.row},
                     args.out.data<float>() + i * s.m * s.n,
                     s.m,
                     s.n,
                     s.k,
                     args.bias ? args.bias->data<float>() : nullptr,
                     args.activation,
                     args.accumulate},
             s.batch == 1);
  });
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace restage::cpu {
RESTAGE_KERNEL(matmul_bf16, MatmulArgs)
}  // namespace restage::cpu
#endif
