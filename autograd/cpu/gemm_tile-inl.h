// Packing and the register tile of matrix products, shared by the kernels that multiply. Compiled
// once per instruction set (targets.h says how).
#if defined(RESTAGE_CPU_GEMM_TILE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef RESTAGE_CPU_GEMM_TILE_INL_H
#undef RESTAGE_CPU_GEMM_TILE_INL_H
#else
#define RESTAGE_CPU_GEMM_TILE_INL_H
#endif

#include <algorithm>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "autograd/cpu/targets.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_AVX3
inline constexpr int kVectorBytes = 64;
inline constexpr int kRows = 12;
#elif HWY_TARGET == HWY_AVX2
inline constexpr int kVectorBytes = 32;
inline constexpr int kRows = 6;
#else
inline constexpr int kVectorBytes = 16;
inline constexpr int kRows = 6;
#endif
inline constexpr int kVectors = 2;
inline constexpr int64_t kDepth = 256;  // k per packed block
inline constexpr int kThin = 4;         // up to so many rows, weights are not packed
// Steps of k per pass while packing: the rows that are read stay in L1.
inline constexpr int64_t kStrip = 16;

template <class T>
struct Simd {
  typedef T Vector __attribute__((vector_size(kVectorBytes), aligned(alignof(T)), may_alias));
  static constexpr int width = kVectorBytes / static_cast<int>(sizeof(T));
  static constexpr int cols = width * kVectors;
};

/// A matrix with free strides.
template <class T>
struct Strided {
  const T* data;
  int64_t row, col;
  const T& at(int64_t i, int64_t j) const { return data[i * row + j * col]; }
  Strided from(int64_t i, int64_t j) const { return {data + i * row + j * col, row, col}; }
};

/// The largest power of two up to n and the width of a vector.
template <class T>
constexpr int lanes_of(int n) {
  int lanes = kVectorBytes / static_cast<int>(sizeof(T));
  while (lanes > n) lanes /= 2;
  return lanes;
}

/// A copy of known length in a few vector moves.
template <int N, class T>
HWY_INLINE void copy_fixed(const T* from, T* to) {
#if HWY_TARGET == HWY_SCALAR
  for (int i = 0; i < N; ++i) to[i] = from[i];
#else
  constexpr int lanes = lanes_of<T>(N);
  const hn::CappedTag<T, lanes> d;
  hn::StoreU(hn::LoadU(d, from), d, to);
  if constexpr (N > lanes) copy_fixed<N - lanes>(from + lanes, to + lanes);
#endif
}

#if HWY_TARGET != HWY_SCALAR
/// Blocks of 16 bytes, `stride` elements apart, as one vector.
template <class D>
HWY_INLINE hn::Vec<D> load_blocks(D d, const hn::TFromD<D>* p, int64_t stride) {
  constexpr int blocks = static_cast<int>(hn::MaxLanes(D()) * sizeof(*p) / 16);
  if constexpr (blocks == 1) {
    return hn::LoadU(d, p);
  } else {
    const hn::Half<D> half;
    return hn::Combine(d, load_blocks(half, p + blocks / 2 * stride, stride),
                       load_blocks(half, p, stride));
  }
}

/// v[l] = rows 0 to Lanes - 1 of `in` at l, for as many l as fill 16 bytes.
template <int Lanes, class T>
struct Transposed {
  static constexpr int block = 16 / static_cast<int>(sizeof(T));
  static constexpr hn::CappedTag<T, Lanes> d{};
  hn::Vec<hn::CappedTag<T, Lanes>> v[block];

  HWY_INLINE Transposed(const T* in, int64_t stride) {
    const auto row = [&](int i)
                         HWY_ATTR { return load_blocks(d, in + i * stride, block * stride); };
    if constexpr (block == 2) {
      const auto r0 = row(0), r1 = row(1);
      v[0] = hn::InterleaveLower(d, r0, r1);
      v[1] = hn::InterleaveUpper(d, r0, r1);
    } else {
      const auto r0 = row(0), r1 = row(1), r2 = row(2), r3 = row(3);
      const auto lower0 = hn::InterleaveLower(d, r0, r2), lower1 = hn::InterleaveLower(d, r1, r3);
      const auto upper0 = hn::InterleaveUpper(d, r0, r2), upper1 = hn::InterleaveUpper(d, r1, r3);
      v[0] = hn::InterleaveLower(d, lower0, lower1);
      v[1] = hn::InterleaveUpper(d, lower0, lower1);
      v[2] = hn::InterleaveLower(d, upper0, upper1);
      v[3] = hn::InterleaveUpper(d, upper0, upper1);
    }
  }
};
#endif

/// Transposes Rows rows of `in` (`stride` apart) for l < k: out[l * step + i] = in[i * stride + l].
template <int Rows, class T>
HWY_INLINE void transpose(const T* in, int64_t stride, int64_t k, T* out, int64_t step) {
  int64_t l = 0;
#if HWY_TARGET != HWY_SCALAR
  constexpr int block = 16 / static_cast<int>(sizeof(T));
  constexpr int lanes = lanes_of<T>(Rows);  // rows at a time
  if constexpr (lanes >= block) {
    for (; l + block <= k; l += block) {
      const Transposed<lanes, T> t(in + l, stride);
      for (int i = 0; i < block; ++i) hn::StoreU(t.v[i], t.d, out + (l + i) * step);
    }
    if constexpr (Rows > lanes)
      transpose<Rows - lanes>(in + lanes * stride, stride, l, out + lanes, step);
  }
#endif
  for (; l < k; ++l)
    for (int i = 0; i < Rows; ++i) out[l * step + i] = in[i * stride + l];
}

/// A panel of `Width` rows (of a; of b: columns), k-major and zero-padded: out[l * Width + i] =
/// m(i, l) for i < count.
template <int Width, class T>
inline void pack_panel(const Strided<T>& m, int64_t count, int64_t k, T* out) {
  if (count == Width && m.col == 1) return transpose<Width>(m.data, m.row, k, out, Width);
  if (count < Width) std::fill_n(out, k * Width, T(0));
  for (int64_t l = 0; l < k; ++l, out += Width) {
    if (count == Width && m.row == 1) {
      copy_fixed<Width>(m.data + l * m.col, out);
    } else {
      for (int i = 0; i < count; ++i) out[i] = m.at(i, l);
    }
  }
}

/// Panels of `Width` rows one after the other. Rows that lie side by side are read a strip of k at
/// a time, so that what a cache line holds for the next panel is still there.
template <int Width, class T>
inline void pack_panels(const Strided<T>& m, int64_t count, int64_t k, T* out) {
  const int64_t strip = m.row == 1 ? kStrip : k;
  for (int64_t l = 0; l < k; l += strip)
    for (int64_t i = 0; i < count; i += Width)
      pack_panel<Width>(m.from(i, l), std::min<int64_t>(Width, count - i), std::min(strip, k - l),
                        out + i * k + l * Width);
}

/// Panels of kRows rows, k-major inside, zero-padded.
template <class T>
inline void pack_a(const Strided<T>& a, int64_t m, int64_t k, T* out) {
  pack_panels<kRows>(a, m, k, out);
}

/// Panels of `cols` columns, k-major inside, zero-padded.
template <class T>
inline void pack_b(const Strided<T>& b, int64_t k, int64_t n, T* out) {
  pack_panels<Simd<T>::cols>(Strided<T>{b.data, b.col, b.row}, n, k, out);
}

/// Sums of a register tile: [Rows, cols].
template <class T, int Rows>
using Sums = typename Simd<T>::Vector[Rows][kVectors];

/// The tile a times b (packed): every element one chain of multiply-adds over k in order. a(i, l)
/// is the number of a's row i at l.
template <class T, int Rows, class A>
HWY_INLINE void sum_of(int64_t k, const A& a, const T* b, Sums<T, Rows>& acc) {
  using V = typename Simd<T>::Vector;
  for (int64_t l = 0; l < k; ++l, b += Simd<T>::cols) {
    alignas(kVectorBytes) V bv[kVectors];
#pragma GCC unroll 2
    for (int v = 0; v < kVectors; ++v) bv[v] = *reinterpret_cast<const V*>(b + v * Simd<T>::width);
#pragma GCC unroll 12
    for (int i = 0; i < Rows; ++i) {
#pragma GCC unroll 2
      for (int v = 0; v < kVectors; ++v) acc[i][v] += a(i, l) * bv[v];
    }
  }
}

/// a is packed, Stride rows wide.
template <class T, int Rows, int Stride>
HWY_INLINE void sum(int64_t k, const T* a, const T* b, Sums<T, Rows>& acc) {
  sum_of<T, Rows>(
      k, [a](int i, int64_t l) HWY_ATTR { return a[l * Stride + i]; }, b, acc);
}

/// Rows of a as they lie in memory, `row` numbers from one to the next: the same bits.
template <class T, int Rows>
HWY_INLINE void sum_rows(int64_t k, const T* a, int64_t row, const T* b, Sums<T, Rows>& acc) {
  sum_of<T, Rows>(
      k, [a, row](int i, int64_t l) HWY_ATTR { return a[i * row + l]; }, b, acc);
}

/// out [Rows, cols] = a (packed, Stride rows wide) times b (packed), plus out if Add.
template <class T, int Rows = kRows, int Stride = Rows, bool Add = false>
inline void multiply(int64_t k, const T* a, const T* b, T* out) {
  using V = typename Simd<T>::Vector;
  alignas(kVectorBytes) Sums<T, Rows> acc = {};
  sum<T, Rows, Stride>(k, a, b, acc);
#pragma GCC unroll 12
  for (int i = 0; i < Rows; ++i) {
#pragma GCC unroll 2
    for (int v = 0; v < kVectors; ++v) {
      V* to = reinterpret_cast<V*>(out + i * Simd<T>::cols + v * Simd<T>::width);
      *to = Add ? *to + acc[i][v] : acc[i][v];
    }
  }
}

/// The same product for 1 to kRows rows of a panel that is kRows wide.
template <class T, bool Add, int Rows = kRows>
inline void multiply_rows(int64_t rows, int64_t k, const T* a, const T* b, T* out) {
  if (rows == Rows) return multiply<T, Rows, kRows, Add>(k, a, b, out);
  if constexpr (Rows > 1) multiply_rows<T, Add, Rows - 1>(rows, k, a, b, out);
}

/// Weights as they lie in memory, rows of k numbers, from some row on.
template <class T>
struct Weights {
  const T* data;
  int64_t k;
  Weights from(int64_t row) const { return {data + row * k, k}; }
};

#if HWY_TARGET != HWY_SCALAR
/// Rows of a [Rows, k] times as many rows of b as a cache line has numbers, which are turned in
/// registers; adds to out, whose rows are `cols` apart, block of kDepth by block. Each line of b is
/// asked for kAhead numbers early, and the first ones of `next`, what is read after b, at the end.
template <class T, int Rows>
HWY_INLINE void multiply_thin_tile(const T* a, const Weights<T>& b, const Weights<T>& next,
                                   T* out) {
  constexpr int cols = Simd<T>::cols;
  constexpr int width = Simd<T>::width, line = 64 / sizeof(T), tile = std::min(line, cols);
  using Turned = Transposed<width, T>;
  constexpr auto d = Turned::d;
  using V = hn::Vec<hn::CappedTag<T, width>>;
  constexpr int64_t kAhead = 4 * line;
  const int64_t k = b.k;
  for (int64_t begin = 0; begin < k; begin += kDepth) {
    const int64_t end = std::min(k, begin + kDepth);
    V acc[Rows][tile / width];
    for (auto& row : acc)
      for (auto& x : row) x = hn::Zero(d);
    const auto add = [&](int v, int64_t l, V b_of_l) HWY_ATTR {
      for (int i = 0; i < Rows; ++i)
        acc[i][v] = hn::MulAdd(hn::Set(d, a[i * k + l]), b_of_l, acc[i][v]);
    };
    int64_t l0 = begin;
    for (; l0 + line <= end; l0 += line) {
      const bool inside = l0 + kAhead < k;
      const T* ahead = inside ? b.data + l0 + kAhead : next.data + (l0 + kAhead - k);
      const int64_t step = inside ? k : next.k;
      for (int v = 0; v < tile / width; ++v) {
        for (int j = 0; j < width; ++j, ahead += step) __builtin_prefetch(ahead);
        const T* from = b.data + v * width * k + l0;
        for (int64_t l = 0; l < line; l += Turned::block) {
          const Turned t(from + l, k);
          for (int e = 0; e < Turned::block; ++e) add(v, l0 + l + e, t.v[e]);
        }
      }
    }
    for (; l0 < end; ++l0) {
      HWY_ALIGN T column[tile];
      for (int j = 0; j < tile; ++j) column[j] = b.data[j * k + l0];
      for (int v = 0; v < tile / width; ++v) add(v, l0, hn::Load(d, column + v * width));
    }
    for (int i = 0; i < Rows; ++i)
      for (int v = 0; v < tile / width; ++v) {
        T* to = out + i * cols + v * width;
        hn::StoreU(hn::Add(hn::LoadU(d, to), acc[i][v]), d, to);
      }
  }
}

#endif

/// out [Rows, cols] = rows of a [Rows, k] times rows of b, summed in blocks of kDepth: weights that
/// are used once are never packed.
template <class T, int Rows>
inline void multiply_thin(const T* a, const Weights<T>& b, [[maybe_unused]] const Weights<T>& next,
                          T* out) {
  constexpr int cols = Simd<T>::cols;
  std::fill_n(out, Rows * cols, T(0));
#if HWY_TARGET != HWY_SCALAR
  constexpr int tile = std::min<int>(64 / sizeof(T), cols);
  for (int j = 0; j < cols; j += tile)
    multiply_thin_tile<T, Rows>(a, b.from(j), j + tile < cols ? b.from(j + tile) : next, out + j);
#else
  for (int64_t begin = 0; begin < b.k; begin += kDepth)
    for (int i = 0; i < Rows; ++i)
      for (int j = 0; j < cols; ++j) {
        T x = 0;
        for (int64_t l = begin; l < std::min(b.k, begin + kDepth); ++l)
          x += a[i * b.k + l] * b.data[j * b.k + l];
        out[i * cols + j] += x;
      }
#endif
}

/// The same product for 1 to Rows rows.
template <class T, int Rows = kThin>
inline void multiply_thin_rows(int64_t rows, const T* a, const Weights<T>& b,
                               const Weights<T>& next, T* out) {
  if (rows == Rows) return multiply_thin<T, Rows>(a, b, next, out);
  if constexpr (Rows > 1) multiply_thin_rows<T, Rows - 1>(rows, a, b, next, out);
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per target
