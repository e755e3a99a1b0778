// Packed, register-tiled matrix product. Output tiles go to threads; the sum over k stays in one
// thread and in one order.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "autograd/cpu/matmul.cpp"
#include <hwy/foreach_target.h>  // once per instruction set

#include <algorithm>
#include <vector>

#include "autograd/cpu/common.h"
#include "autograd/cpu/gemm_tile-inl.h"
#include "autograd/cpu/kernels.h"
#include "autograd/cpu/targets.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {
namespace {

constexpr int64_t kTileRows = 288;  // multiple of kRows
constexpr int64_t kTileCols = 512;  // multiple of every kCols

template <class T>
struct Product {
  Strided<T> a, b;
  T* out;
  int64_t m, n, k;
  const T* bias;
  Activation activation;
  bool accumulate;
};

/// Writes a computed register tile: the first block of k overwrites (unless accumulating), later
/// ones add; the last one applies bias and activation.
template <class T>
void store(const Product<T>& p, const T* tile, int64_t i0, int64_t j0, bool first, bool last) {
  constexpr int cols = Simd<T>::cols;
  const int64_t rows = std::min<int64_t>(kRows, p.m - i0),
                width = std::min<int64_t>(cols, p.n - j0);
  const bool add = !first || p.accumulate;
  for (int64_t i = 0; i < rows; ++i) {
    T* c = p.out + (i0 + i) * p.n + j0;
    const T* t = tile + i * cols;
    if (add) {
      for (int64_t j = 0; j < width; ++j) c[j] += t[j];
    } else {
      for (int64_t j = 0; j < width; ++j) c[j] = t[j];
    }
    if (!last) continue;
    if (p.bias)
      for (int64_t j = 0; j < width; ++j) c[j] += p.bias[j0 + j];
    if (p.activation == Activation::relu)
      for (int64_t j = 0; j < width; ++j) c[j] = c[j] <= T(0) ? T(0) : c[j];  // NaN stays
  }
}

/// Per-thread packing memory, kept between calls.
template <class T>
T* workspace(int which, int64_t count) {
  thread_local std::vector<T> memory[2];
  auto& buffer = memory[which];
  if (static_cast<int64_t>(buffer.size()) < count) buffer.resize(static_cast<size_t>(count));
  return buffer.data();
}

template <class T>
void tile(const Product<T>& p, int64_t i0, int64_t i1, int64_t j0, int64_t j1) {
  constexpr int cols = Simd<T>::cols;
  const int64_t depth = std::min(kDepth, p.k);
  const int64_t row_panels = (i1 - i0 + kRows - 1) / kRows,
                col_panels = (j1 - j0 + cols - 1) / cols;
  T* pa = workspace<T>(0, row_panels * kRows * depth);
  T* pb = workspace<T>(1, col_panels * cols * depth);
  T result[kRows * Simd<T>::cols];
  for (int64_t l0 = 0; l0 < p.k; l0 += kDepth) {
    const int64_t l = std::min(kDepth, p.k - l0);
    pack_a<T>({&p.a.at(i0, l0), p.a.row, p.a.col}, i1 - i0, l, pa);
    pack_b<T>({&p.b.at(l0, j0), p.b.row, p.b.col}, l, j1 - j0, pb);
    for (int64_t jp = 0; jp < col_panels; ++jp) {
      for (int64_t ip = 0; ip < row_panels; ++ip) {
        multiply<T>(l, pa + ip * kRows * l, pb + jp * cols * l, result);
        store(p, result, i0 + ip * kRows, j0 + jp * cols, l0 == 0, l0 + l == p.k);
      }
    }
  }
}

/// Nothing to add up: the product is zero.
template <class T>
void empty_sum(const Product<T>& p) {
  for (int64_t i = 0; i < p.m; ++i)
    for (int64_t j = 0; j < p.n; ++j) {
      T& c = p.out[i * p.n + j];
      c = (p.accumulate ? c : T(0)) + (p.bias ? p.bias[j] : T(0));
      if (p.activation == Activation::relu && c <= T(0)) c = 0;
    }
}

/// Tile sizes follow from the shape alone; small products are cut finer to have pieces to share.
int64_t tile_rows(int64_t m, int64_t n) {
  int64_t rows = kTileRows;
  const int64_t col_tiles = (n + kTileCols - 1) / kTileCols;
  while (rows > 4 * kRows && (m + rows - 1) / rows * col_tiles < 8) rows /= 2;
  return std::max<int64_t>(kRows, rows / kRows * kRows);
}

int64_t tile_cols(int64_t m, int64_t n) {
  int64_t cols = kTileCols;
  while (cols > 128 && m < 2 * kTileRows && (n + cols - 1) / cols < 8) cols /= 2;
  return cols;
}

template <class T>
void run(const MatmulArgs& args) {
  const int ra = args.a.rank(), rb = args.b.rank(), ro = args.out.rank();
  const int64_t m = args.out.size(ro - 2), n = args.out.size(ro - 1);
  const int64_t k = args.a.size(args.transpose_a ? ra - 2 : ra - 1);
  const int64_t batch = args.out.shape().product(0, ro - 2);
  const int64_t step_a = ra > 2 ? m * k : 0, step_b = rb > 2 ? n * k : 0;
  const int64_t tr = tile_rows(m, n), tc = tile_cols(m, n);
  const int64_t row_tiles = (m + tr - 1) / tr, col_tiles = (n + tc - 1) / tc;
  const int64_t tiles = row_tiles * col_tiles;
  if (m == 0 || n == 0 || batch == 0) return;
  const T* a = args.a.data<T>();
  const T* b = args.b.data<T>();
  T* out = args.out.data<T>();
  const int64_t work = 2 * std::min(tr, m) * std::min(tc, n) * std::max<int64_t>(k, 1);
  const int64_t grain = std::max<int64_t>(1, (1 << 18) / work);
  parallel_for(batch * tiles, grain, [&](int64_t from, int64_t to) HWY_ATTR {
    for (int64_t t = from; t < to; ++t) {
      const int64_t bi = t / tiles, ti = t % tiles / col_tiles, tj = t % col_tiles;
      const Product<T> p{{a + bi * step_a, args.transpose_a ? 1 : k, args.transpose_a ? m : 1},
                         {b + bi * step_b, args.transpose_b ? 1 : n, args.transpose_b ? k : 1},
                         out + bi * m * n,
                         m,
                         n,
                         k,
                         args.bias ? args.bias->data<T>() : nullptr,
                         args.activation,
                         args.accumulate};
      if (k == 0) {
        if (ti == 0 && tj == 0) empty_sum(p);
        continue;
      }
      tile(p, ti * tr, std::min(m, (ti + 1) * tr), tj * tc, std::min(n, (tj + 1) * tc));
    }
  });
}

}  // namespace

void matmul(const MatmulArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR { run<decltype(zero)>(args); });
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace restage::cpu {
RESTAGE_KERNEL(matmul, MatmulArgs)
}  // namespace restage::cpu
#endif
