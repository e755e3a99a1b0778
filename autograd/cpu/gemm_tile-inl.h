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
#include <vector>

#include "autograd/cpu/targets.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {

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
};

/// A copy of known length, which becomes a few vector moves instead of a call.
template <int N, class T>
inline void copy_fixed(const T* from, T* to) {
  for (int i = 0; i < N; ++i) to[i] = from[i];
}

/// Panels of kRows rows, k-major inside, zero-padded.
template <class T>
inline void pack_a(const Strided<T>& a, int64_t m, int64_t k, T* out) {
  for (int64_t i0 = 0; i0 < m; i0 += kRows) {
    const int64_t rows = std::min<int64_t>(kRows, m - i0);
    if (rows == kRows && a.col == 1) {
      const T* p = a.data + i0 * a.row;
      for (int64_t l = 0; l < k; ++l)
        for (int i = 0; i < kRows; ++i) out[l * kRows + i] = p[i * a.row + l];
    } else if (rows == kRows && a.row == 1) {
      for (int64_t l = 0; l < k; ++l) copy_fixed<kRows>(a.data + i0 + l * a.col, out + l * kRows);
    } else {
      for (int64_t l = 0; l < k; ++l)
        for (int i = 0; i < kRows; ++i) out[l * kRows + i] = i < rows ? a.at(i0 + i, l) : T(0);
    }
    out += k * kRows;
  }
}

/// Panels of `cols` columns, k-major inside, zero-padded.
template <class T>
inline void pack_b(const Strided<T>& b, int64_t k, int64_t n, T* out) {
  constexpr int cols = Simd<T>::cols;
  for (int64_t j0 = 0; j0 < n; j0 += cols) {
    const int64_t width = std::min<int64_t>(cols, n - j0);
    if (width == cols && b.col == 1) {
      for (int64_t l = 0; l < k; ++l) copy_fixed<cols>(b.data + l * b.row + j0, out + l * cols);
    } else if (width == cols && b.row == 1) {
      constexpr int64_t block = 16;  // columns of memory at a time: whole cache lines of both sides
      for (int64_t l0 = 0; l0 < k; l0 += block)
        for (int j = 0; j < cols; ++j) {
          const T* p = b.data + (j0 + j) * b.col + l0;
          for (int64_t l = 0; l < std::min(block, k - l0); ++l) out[(l0 + l) * cols + j] = p[l];
        }
    } else {
      for (int64_t l = 0; l < k; ++l)
        for (int j = 0; j < cols; ++j) out[l * cols + j] = j < width ? b.at(l, j0 + j) : T(0);
    }
    out += k * cols;
  }
}

/// out [Rows, cols] = a (packed, Rows wide) times b (packed): every element one chain of
/// multiply-adds over k in order.
template <class T, int Rows = kRows>
inline void multiply(int64_t k, const T* a, const T* b, T* out) {
  using V = typename Simd<T>::Vector;
  constexpr int width = Simd<T>::width;
  V acc[Rows][kVectors] = {};
  for (int64_t l = 0; l < k; ++l) {
    V bv[kVectors];
#pragma GCC unroll 2
    for (int v = 0; v < kVectors; ++v) bv[v] = *reinterpret_cast<const V*>(b + v * width);
#pragma GCC unroll 12
    for (int i = 0; i < Rows; ++i) {
#pragma GCC unroll 2
      for (int v = 0; v < kVectors; ++v) acc[i][v] += a[i] * bv[v];
    }
    a += Rows;
    b += Simd<T>::cols;
  }
#pragma GCC unroll 12
  for (int i = 0; i < Rows; ++i) {
#pragma GCC unroll 2
    for (int v = 0; v < kVectors; ++v)
      *reinterpret_cast<V*>(out + i * Simd<T>::cols + v * width) = acc[i][v];
  }
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per target
