// Products of matrices that are packed once and used while they are in the cache: what a fused
// kernel multiplies its tiles with. Per target, like gemm_tile-inl.h.
#if defined(RESTAGE_CPU_PACKED_PRODUCT_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef RESTAGE_CPU_PACKED_PRODUCT_INL_H
#undef RESTAGE_CPU_PACKED_PRODUCT_INL_H
#else
#define RESTAGE_CPU_PACKED_PRODUCT_INL_H
#endif

#include "autograd/cpu/gemm_tile-inl.h"
#include "autograd/kernels/stats.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {

inline int64_t whole_panels(int64_t n, int64_t panel) { return (n + panel - 1) / panel * panel; }

/// Memory that grows and stays.
template <class T>
struct Buffer {
  std::vector<T> memory;
  T* at_least(int64_t count) {
    if (static_cast<int64_t>(memory.size()) < count) memory.resize(static_cast<size_t>(count));
    return memory.data();
  }
};

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

/// The same for a matrix whose rows lie anywhere: row l is rows[l][0..n).
template <class T>
const T* pack_rows_right(const std::vector<const T*>& rows, int64_t n, Buffer<T>& buffer) {
  constexpr int cols = Simd<T>::cols;
  const int64_t k = std::ssize(rows), width = whole_panels(n, cols);
  T* out = buffer.at_least(width * k);
  T* to = out;
  for (int64_t l0 = 0; l0 < k; l0 += kDepth)
    for (int64_t j = 0; j < n; j += cols)
      for (int64_t l = l0; l < std::min(k, l0 + kDepth); ++l, to += cols) {
        const T* from = rows[static_cast<size_t>(l)] + j;
        if (n - j >= cols) {
          copy_fixed<cols>(from, to);
        } else {
          for (int64_t c = 0; c < cols; ++c) to[c] = j + c < n ? from[c] : T(0);
        }
      }
  return out;
}

/// out [m, n] (rows `ld` apart) = left right, or += if add.
template <class T>
void product(int64_t m, int64_t n, int64_t k, const T* left, const T* right, T* out, int64_t ld,
             bool add = false) {
  constexpr int cols = Simd<T>::cols;
  const int64_t rows = whole_panels(m, kRows), width = whole_panels(n, cols);
  T tile[kRows * cols];
  count_flops(2.0 * static_cast<double>(m * n * k));
  for (int64_t l0 = 0; l0 < k; l0 += kDepth) {
    const int64_t l = std::min(kDepth, k - l0);
    const bool sum = add || l0 > 0;
    for (int64_t j0 = 0; j0 < n; j0 += cols) {
      const int64_t w = std::min<int64_t>(cols, n - j0);
      for (int64_t i0 = 0; i0 < m; i0 += kRows) {
        multiply<T>(l, left + rows * l0 + i0 * l, right + width * l0 + j0 * l, tile);
        for (int64_t i = 0; i < std::min<int64_t>(kRows, m - i0); ++i) {
          T* c = out + (i0 + i) * ld + j0;
          const T* t = tile + i * cols;
          if (sum) {
            for (int64_t j = 0; j < w; ++j) c[j] += t[j];
          } else {
            for (int64_t j = 0; j < w; ++j) c[j] = t[j];
          }
        }
      }
    }
  }
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per target
