// Products of matrices that are packed once and used while they are in the cache: what a fused
// kernel multiplies its tiles with. Per target, like gemm_tile-inl.h.
#if defined(RESTAGE_CPU_PACKED_PRODUCT_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef RESTAGE_CPU_PACKED_PRODUCT_INL_H
#undef RESTAGE_CPU_PACKED_PRODUCT_INL_H
#else
#define RESTAGE_CPU_PACKED_PRODUCT_INL_H
#endif

#include <cstring>

#include "autograd/cpu/buffer.h"
#include "autograd/cpu/gemm_tile-inl.h"
#include "autograd/kernels/stats.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {

inline int64_t whole_panels(int64_t n, int64_t panel) { return (n + panel - 1) / panel * panel; }

/// Rows [m, k] for the left side of product(): blocks of kDepth, in them panels of rows.
template <class T>
const T* pack_left(const Strided<T>& a, int64_t m, int64_t k, Buffer<T>& buffer) {
  const int64_t rows = whole_panels(m, kRows);
  T* out = buffer.at_least(rows * k);
  for (int64_t l = 0; l < k; l += kDepth)
    pack_a<T>({&a.at(0, l), a.row, a.col}, m, std::min(kDepth, k - l), out + rows * l);
  return out;
}

/// Columns [k, n] for the right side.
template <class T>
const T* pack_right(const Strided<T>& b, int64_t k, int64_t n, Buffer<T>& buffer) {
  const int64_t cols = whole_panels(n, Simd<T>::cols);
  T* out = buffer.at_least(cols * k);
  for (int64_t l = 0; l < k; l += kDepth)
    pack_b<T>({&b.at(l, 0), b.row, b.col}, std::min(kDepth, k - l), n, out + cols * l);
  return out;
}

/// Columns [k, n] for the right side, of a matrix whose rows lie anywhere: row l is rows[l][0..n).
template <class T>
const T* pack_rows_right(const std::vector<const T*>& rows, int64_t n, Buffer<T>& buffer) {
  constexpr int cols = Simd<T>::cols;
  const int64_t k = std::ssize(rows), width = whole_panels(n, cols);
  T* out = buffer.at_least(width * k);
  T* to = out;
  for (int64_t l0 = 0; l0 < k; l0 += kDepth)
    for (int64_t j = 0; j < n; j += cols)
      for (int64_t l = l0; l < std::min(k, l0 + kDepth); ++l, to += cols) {
        const T* from = rows[l] + j;
        if (n - j >= cols) {
          copy_fixed<cols>(from, to);
        } else {
          for (int64_t c = 0; c < cols; ++c) to[c] = j + c < n ? from[c] : T(0);
        }
      }
  return out;
}

/// One register tile of product(). A whole tile goes from registers straight to out.
template <class T>
HWY_INLINE void product_tile(int64_t rows, int64_t columns, int64_t k, const T* left,
                             const T* right, T* out, int64_t ld, bool add) {
  using V = typename Simd<T>::Vector;
  constexpr int cols = Simd<T>::cols;
  alignas(kVectorBytes) Sums<T, kRows> acc = {};
  sum<T, kRows, kRows>(k, left, right, acc);
  if (rows == kRows && columns == cols) {
#pragma GCC unroll 12
    for (int i = 0; i < kRows; ++i) {
#pragma GCC unroll 2
      for (int v = 0; v < kVectors; ++v) {
        V* to = reinterpret_cast<V*>(out + i * ld + v * Simd<T>::width);
        *to = add ? *to + acc[i][v] : acc[i][v];
      }
    }
    return;
  }
  alignas(kVectorBytes) T tile[kRows * cols];
  std::memcpy(tile, acc, sizeof tile);
  for (int64_t i = 0; i < rows; ++i)
    for (int64_t j = 0; j < columns; ++j)
      out[i * ld + j] = add ? out[i * ld + j] + tile[i * cols + j] : tile[i * cols + j];
}

/// out [m, n] (rows `ld` apart) = left right, or += if add.
template <class T>
void product(int64_t m, int64_t n, int64_t k, const T* left, const T* right, T* out, int64_t ld,
             bool add = false) {
  constexpr int cols = Simd<T>::cols;
  const int64_t rows = whole_panels(m, kRows), width = whole_panels(n, cols);
  count_flops(2.0 * static_cast<double>(m * n * k));
  for (int64_t l0 = 0; l0 < k; l0 += kDepth) {
    const int64_t l = std::min(kDepth, k - l0);
    for (int64_t j = 0; j < n; j += cols)
      for (int64_t i = 0; i < m; i += kRows)
        product_tile<T>(std::min<int64_t>(kRows, m - i), std::min<int64_t>(cols, n - j), l,
                        left + rows * l0 + i * l, right + width * l0 + j * l, out + i * ld + j, ld,
                        add || l0 > 0);
  }
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per target
