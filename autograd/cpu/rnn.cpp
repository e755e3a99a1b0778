// GRU layers. Threads share the hidden units: each takes some through a step for all rows of the
// batch, so a weight is fetched once a step whatever the batch, and waits for the others before the
// next. States go from step to step in the layout that products read.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "autograd/cpu/rnn.cpp"
#include <hwy/foreach_target.h>  // once per instruction set

#include <algorithm>
#include <vector>

#include "autograd/cpu/common.h"
#include "autograd/cpu/gemm_tile-inl.h"
#include "autograd/cpu/kernels.h"
#include "autograd/cpu/math-inl.h"
#include "autograd/cpu/targets.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {
namespace {

constexpr int64_t kPiece = 1 << 15;  // recurrent weights that a piece of a step has at least

int64_t round_up(int64_t n, int64_t step) { return (n + step - 1) / step * step; }

/// Calls body(first, count) for blocks of up to `cols` hidden units, on all threads.
template <class T, class F>
void for_units(int64_t h, const F& body) {
  constexpr int64_t cols = Simd<T>::cols;
  const int64_t grain = std::max<int64_t>(1, kPiece / (3 * h * cols));
  parallel_for((h + cols - 1) / cols, grain, [&](int64_t from, int64_t to) {
    for (int64_t b = from; b < to; ++b) body(b * cols, std::min(cols, h - b * cols));
  });
}

/// All rows of a batch, [n, k], in panels of kRows rows, k-major: what multiply_rows() reads.
template <class T>
struct Panels {
  Panels(int64_t n, int64_t columns)
      : k(columns), data(static_cast<size_t>(round_up(n, kRows) * columns)) {}
  T* at(int64_t row, int64_t column) { return data.data() + row * k + column * kRows; }
  /// Takes columns from `column` on of up to kRows rows from `row` on, a multiple of kRows.
  void put(const T* rows, int64_t stride, int64_t row, int64_t count, int64_t column,
           int64_t width) {
    T* to = at(row, column);
    if (count == kRows) return transpose<kRows>(rows, stride, width, to, kRows);
    for (int64_t j = 0; j < width; ++j)
      for (int64_t i = 0; i < count; ++i) to[j * kRows + i] = rows[i * stride + j];
  }
  int64_t k;
  std::vector<T> data;
};

/// One vector of hidden units of one row. in: gi (r, z, n), gh (r, z, n), bias (r, z, n), old
/// state; out: r, z, n, W_hn h + b_hn, new state.
template <class T>
HWY_INLINE void cell_vector(const T* const* in, T* const* out, int64_t j) {
  const hn::ScalableTag<T> d;
  const auto load = [&](int i) HWY_ATTR { return hn::LoadU(d, in[i] + j); };
  const auto gate = [&](int g) HWY_ATTR {
    return sigmoid(hn::Add(hn::Add(load(g), load(3 + g)), load(6 + g)));
  };
  const auto r = gate(0), z = gate(1);
  const auto kept = hn::Add(load(5), load(8));
  const auto n = tanh(hn::MulAdd(r, kept, load(2)));
  const auto state = hn::MulAdd(hn::Sub(hn::Set(d, T(1)), z), n, hn::Mul(z, load(9)));
  hn::StoreU(r, d, out[0] + j);
  hn::StoreU(z, d, out[1] + j);
  hn::StoreU(n, d, out[2] + j);
  hn::StoreU(kept, d, out[3] + j);
  hn::StoreU(state, d, out[4] + j);
}

/// `count` hidden units of one row; the last ones go through a padded vector.
template <class T>
void cell(const T* const* in, T* const* out, int64_t count) {
  const hn::ScalableTag<T> d;
  const auto lanes = static_cast<int64_t>(hn::Lanes(d));
  int64_t j = 0;
  for (; j + lanes <= count; j += lanes) cell_vector(in, out, j);
  if (j == count) return;
  T padded[15][HWY_MAX_BYTES / sizeof(T)] = {};
  const T* from[10];
  T* to[5];
  for (int i = 0; i < 10; ++i) from[i] = std::copy_n(in[i] + j, count - j, padded[i]) - (count - j);
  for (int i = 0; i < 5; ++i) to[i] = padded[10 + i];
  cell_vector(from, to, 0);
  for (int i = 0; i < 5; ++i) std::copy_n(to[i], count - j, out[i] + j);
}

/// Gradients at one row's hidden units. gates and g_gi, g_gh are h apart per gate; g: gradient of
/// the new state; `direct` gets the part that goes straight to the old one.
template <class T>
void cell_grad(const T* gates, const T* previous, const T* g_out, int64_t h, int64_t count, T* gi,
               T* gh, T* direct) {
  for (int64_t i = 0; i < count; ++i) {
    const T r = gates[i], z = gates[h + i], n = gates[2 * h + i], kept = gates[3 * h + i];
    const T g = g_out[i];
    const T in = g * (T(1) - z) * (T(1) - n * n);
    const T iz = g * (previous[i] - n) * z * (T(1) - z);
    const T ir = in * kept * r * (T(1) - r);
    gi[i] = gh[i] = ir;
    gi[h + i] = gh[h + i] = iz;
    gi[2 * h + i] = in;
    gh[2 * h + i] = in * r;
    direct[i] = g * z;
  }
}

template <class T>
struct Forward {
  static constexpr int cols = Simd<T>::cols;
  const GruArgs& args;
  const int64_t steps = args.gi.size(0), n = args.gi.size(1), h = args.h0.size(1);
  const int64_t padded = round_up(h, cols);
  /// A step alone reads the weights as they lie; more steps are worth packing them once.
  const bool thin = steps == 1 && n <= kThin && padded == h;
  std::vector<T> w = std::vector<T>(static_cast<size_t>(thin ? 0 : 3 * padded * h));
  Panels<T> now{n, h}, next{n, h};

  void pack(int64_t j, int64_t width) {
    for (int64_t g = 0; g < 3; ++g)
      pack_b<T>({args.w_hh.data<T>() + (g * h + j) * h, 1, h}, h, width,
                w.data() + (g * padded + j) * h);
  }

  void products(int64_t i, int64_t rows, int64_t j, T (*gh)[kRows * cols]) {
    for (int64_t g = 0; g < 3; ++g) {
      if (thin) {
        const T* weights = args.w_hh.data<T>() + (g * h + j) * h;
        multiply_thin_rows<T>(rows, h, args.h0.data<T>(), h, weights, h,
                              g * h + j + 2 * cols <= 3 * h ? cols * h : 0, gh[g]);
      } else {
        multiply_rows<T>(rows, h, now.at(i, 0), w.data() + (g * padded + j) * h, gh[g]);
      }
    }
  }

  void step(int64_t t, int64_t j, int64_t width) {
    alignas(64) T gh[3][kRows * cols];
    const T* bias = args.b_hh.data<T>() + j;
    const T* state = (t > 0 ? args.out.data<T>() + (t - 1) * n * h : args.h0.data<T>()) + j;
    T* out = args.out.data<T>() + t * n * h + j;
    for (int64_t i0 = 0; i0 < n; i0 += kRows) {
      const int64_t rows = std::min<int64_t>(kRows, n - i0);
      products(i0, rows, j, gh);
      for (int64_t i = i0; i < i0 + rows; ++i) {
        const T* gi = args.gi.data<T>() + (t * n + i) * 3 * h + j;
        T* gates = args.gates.data<T>() + (t * n + i) * 4 * h + j;
        const int64_t at = (i - i0) * cols;
        const T* in[] = {gi,         gi + h, gi + 2 * h, gh[0] + at,   gh[1] + at,
                         gh[2] + at, bias,   bias + h,   bias + 2 * h, state + i * h};
        T* results[] = {gates, gates + h, gates + 2 * h, gates + 3 * h, out + i * h};
        cell(in, results, width);
      }
      if (t + 1 < steps) next.put(out + i0 * h, h, i0, rows, j, width);
    }
  }

  void run() {
    if (steps == 0) return;
    if (!thin) {
      for_units<T>(h, [&](int64_t j, int64_t width) { pack(j, width); });
      for (int64_t i = 0; i < n; i += kRows)
        now.put(args.h0.data<T>() + i * h, h, i, std::min<int64_t>(kRows, n - i), 0, h);
    }
    for (int64_t t = 0; t < steps; ++t) {
      for_units<T>(h, [&](int64_t j, int64_t width) { step(t, j, width); });
      std::swap(now, next);
    }
  }
};

template <class T>
struct Backward {
  static constexpr int cols = Simd<T>::cols;
  const GruGradArgs& args;
  const int64_t steps = args.gy.size(0), n = args.gy.size(1), h = args.h0.size(1);
  std::vector<T> w = std::vector<T>(static_cast<size_t>(round_up(h, cols) * 3 * h));
  std::vector<T> direct = std::vector<T>(static_cast<size_t>(n * h));
  Panels<T> now{n, 3 * h}, next{n, 3 * h};  // g_gh of the step before (in time: after) and of this

  /// Gradient of the state after step t at some rows and units: [rows, cols].
  void carry(int64_t t, int64_t i0, int64_t rows, int64_t j, int64_t width, T* g) {
    if (t + 1 < steps) {
      multiply_rows<T>(rows, 3 * h, now.at(i0, 0), w.data() + j * 3 * h, g);
    } else {
      std::fill_n(g, rows * cols, T(0));
    }
    for (int64_t i = 0; i < rows; ++i) {
      const T* straight = direct.data() + (i0 + i) * h + j;
      const T* gy = t < 0 ? nullptr : args.gy.data<T>() + (t * n + i0 + i) * h + j;
      for (int64_t u = 0; u < width; ++u) {
        T x = straight[u] + g[i * cols + u];
        if (gy) x += gy[u];
        g[i * cols + u] = x;
      }
    }
  }

  void step(int64_t t, int64_t j, int64_t width) {
    alignas(64) T g[kRows * cols];
    const T* state = t > 0 ? args.y.data<T>() + (t - 1) * n * h : args.h0.data<T>();
    for (int64_t i0 = 0; i0 < n; i0 += kRows) {
      const int64_t rows = std::min<int64_t>(kRows, n - i0);
      carry(t, i0, rows, j, width, g);
      if (t < 0) {
        for (int64_t i = 0; i < rows; ++i)
          std::copy_n(g + i * cols, width, args.out.data<T>() + (i0 + i) * h + j);
        continue;
      }
      T* g_gh = args.g_gh.data<T>() + (t * n + i0) * 3 * h + j;
      for (int64_t i = 0; i < rows; ++i) {
        const int64_t at = t * n + i0 + i;
        cell_grad(args.gates.data<T>() + at * 4 * h + j, state + (i0 + i) * h + j, g + i * cols, h,
                  width, args.g_gi.data<T>() + at * 3 * h + j, g_gh + i * 3 * h,
                  direct.data() + (i0 + i) * h + j);
      }
      for (int64_t gate = 0; gate < 3; ++gate)
        next.put(g_gh + gate * h, 3 * h, i0, rows, gate * h + j, width);
    }
  }

  void run() {
    for_units<T>(h, [&](int64_t j, int64_t width) {
      pack_b<T>({args.w_hh.data<T>() + j, h, 1}, 3 * h, width, w.data() + j * 3 * h);
    });
    for (int64_t t = steps - 1; t >= -1; --t) {  // -1: the gradient of h0
      for_units<T>(h, [&](int64_t j, int64_t width) { step(t, j, width); });
      std::swap(now, next);
    }
  }
};

}  // namespace

void gru(const GruArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR { Forward<decltype(zero)>{args}.run(); });
}

void gru_grad(const GruGradArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR { Backward<decltype(zero)>{args}.run(); });
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace restage::cpu {
RESTAGE_KERNEL(gru, GruArgs)
RESTAGE_KERNEL(gru_grad, GruGradArgs)
}  // namespace restage::cpu
#endif
