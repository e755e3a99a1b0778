// GRU layers. Threads share the hidden units: each takes some through a step for all rows of the
// batch, so a weight is fetched once a step whatever the batch, and waits for the other threads
// before the next step. States go from step to step in the layout that products read.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "autograd/cpu/rnn.cpp"
#include <hwy/foreach_target.h>  // once per instruction set

#include <algorithm>

#include "autograd/cpu/buffer.h"
#include "autograd/cpu/common.h"
#include "autograd/cpu/gemm_tile-inl.h"
#include "autograd/cpu/kernels.h"
#include "autograd/cpu/math-inl.h"
#include "autograd/cpu/targets.h"
#include "autograd/kernels/stats.h"

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

/// Rows per panel: all panels of a batch about equally tall.
int64_t panel_rows(int64_t n) {
  const int64_t panels = (n + kRows - 1) / kRows;
  return n == 0 ? 1 : (n + panels - 1) / panels;
}

/// All rows of a batch, [n, k], in panels of `tall` rows, k-major, kRows apart.
template <class T>
struct Panels {
  Panels(int64_t n, int64_t columns)
      : rows(n),
        k(columns),
        tall(panel_rows(n)),
        data(round_up(n, tall) / tall * kRows * columns) {}
  T* at(int64_t row, int64_t column) const {
    return data.data() + row / tall * kRows * k + column * kRows;
  }
  /// Takes columns from `column` on of all rows.
  void put(const T* from, int64_t stride, int64_t column, int64_t width) {
    for (int64_t row = 0; row < rows; row += tall) {
      const T* in = from + row * stride;
      T* to = at(row, column);
      const int64_t count = std::min(tall, rows - row);
      if (count == kRows) {
        transpose<kRows>(in, stride, width, to, kRows);
        continue;
      }
      for (int64_t i = 0; i < count; ++i)
        for (int64_t j = 0; j < width; ++j) to[j * kRows + i] = in[i * stride + j];
    }
  }
  /// out [rows, cols] = all rows times packed columns, summed as matmul() sums.
  void times(const T* columns, T* out) const {
    constexpr int cols = Simd<T>::cols;
    for (int64_t l0 = 0; l0 < k; l0 += kDepth) {
      const int64_t l = std::min(kDepth, k - l0);
      for (int64_t row = 0; row < rows; row += tall) {
        const int64_t count = std::min(tall, rows - row);
        const T *a = at(row, l0), *b = columns + l0 * cols;
        T* to = out + row * cols;
        if (l0 == 0) {
          multiply_rows<T, false>(count, l, a, b, to);
        } else {
          multiply_rows<T, true>(count, l, a, b, to);
        }
      }
    }
  }
  int64_t rows, k, tall;
  Buffer<T> data;
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
/// the new state; `direct` gets the part that goes straight to the old state.
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

/// A layer as GruArgs has it.
template <class T>
struct Layer {
  static constexpr int cols = Simd<T>::cols;
  explicit Layer(const GruArgs& args)
      : steps(args.x.size(0)),
        n(args.x.size(1)),
        i(args.x.size(2)),
        h(args.h0.size(1)),
        x(args.x.data<T>()),
        h0(args.h0.data<T>()),
        w_ih(args.w_ih.data<T>()),
        w_hh(args.w_hh.data<T>()),
        b_ih(args.b_ih.data<T>()),
        b_hh(args.b_hh.data<T>()),
        out(args.out.data<T>()),
        gates(args.gates != nullptr ? args.gates->data<T>() : nullptr) {}

  const int64_t steps, n, i, h;
  const T *x, *h0, *w_ih, *w_hh, *b_ih, *b_hh;
  T *out, *gates;

  /// Units j to j + width of all rows after step t. gi: W_i x + b_i of the first of them, its gates
  /// `apart`, its rows `row` apart; gh [3, n, cols]: W_h h.
  void cells(int64_t t, int64_t j, int64_t width, const T* gi, int64_t apart, int64_t row,
             const T* gh) const {
    const T *state = (t > 0 ? out + (t - 1) * n * h : h0) + j, *bias = b_hh + j;
    T unasked[4 * cols];
    for (int64_t r = 0; r < n; ++r) {
      const T *in = gi + r * row, *p = gh + r * cols;
      T* g = gates != nullptr ? gates + (t * n + r) * 4 * h + j : unasked;
      const int64_t step = gates != nullptr ? h : cols;
      const T* from[] = {in,           in + apart,       in + 2 * apart, p,
                         p + n * cols, p + 2 * n * cols, bias,           bias + h,
                         bias + 2 * h, state + r * h};
      T* to[] = {g, g + step, g + 2 * step, g + 3 * step, out + (t * n + r) * h + j};
      cell(from, to, width);
    }
  }
};

/// A single step of a few rows: both products and the cells of some units in one go, with weights
/// read as they lie in memory. For more steps or rows packing the weights pays.
template <class T>
struct Frame {
  static constexpr int cols = Simd<T>::cols;
  const Layer<T>& of;

  bool fits() const { return of.steps == 1 && of.n <= kThin && of.h % cols == 0; }

  /// Rows of weights for some units: gates of W_i (0 to 2), then of W_h.
  Weights<T> weights(int64_t product, int64_t j) const {
    return product < 3 ? Weights<T>{of.w_ih, of.i}.from(product * of.h + j)
                       : Weights<T>{of.w_hh, of.h}.from((product - 3) * of.h + j);
  }

  void units(int64_t j) const {
    alignas(64) T sums[6 * kThin * cols];
    const int64_t size = of.n * cols;
    for (int64_t p = 0; p < 6; ++p)
      multiply_thin_rows<T>(of.n, p < 3 ? of.x : of.h0, weights(p, j),
                            weights(std::min<int64_t>(p + 1, 5), j), sums + p * size);
    for (int64_t row = 0; row < 3 * of.n; ++row)
      for (int64_t u = 0; u < cols; ++u) sums[row * cols + u] += of.b_ih[row / of.n * of.h + j + u];
    of.cells(0, j, cols, sums, size, cols, sums + 3 * size);
  }

  void run() const {
    for_units<T>(of.h, [&](int64_t j, int64_t) { units(j); });
  }
};

/// A sequence: its steps one after the other. The products with the inputs of all steps are one
/// product.
template <class T>
struct Sequence {
  static constexpr int cols = Simd<T>::cols;
  Sequence(const Layer<T>& layer, const GruArgs& args)
      : of(layer),
        gi(empty_like(args.x, {of.steps * of.n, 3 * of.h})),
        packed(3 * round_up(of.h, cols) * of.h) {
    cpu::matmul(MatmulArgs{.a = args.x.reshape({of.steps * of.n, of.i}),
                           .b = args.w_ih,
                           .out = gi,
                           .transpose_b = true,
                           .bias = &args.b_ih,
                           .precision = args.precision});
  }

  const Layer<T>& of;
  Tensor gi;
  Buffer<T> packed;
  Panels<T> now{of.n, of.h}, next{of.n, of.h};

  T* weights(int64_t gate, int64_t unit) const {
    return packed.data() + (gate * round_up(of.h, cols) + unit) * of.h;
  }

  void step(int64_t t, int64_t j, int64_t width) {
    const int64_t n = of.n, h = of.h;
    const Buffer<T> gh(3 * n * cols);
    for (int64_t g = 0; g < 3; ++g) now.times(weights(g, j), gh.data() + g * n * cols);
    of.cells(t, j, width, gi.data<T>() + t * n * 3 * h + j, h, 3 * h, gh.data());
    if (t + 1 < of.steps) next.put(of.out + t * n * h + j, h, j, width);
  }

  void run() {
    const int64_t h = of.h;
    if (of.steps > 0) now.put(of.h0, h, 0, h);
    for_units<T>(h, [&](int64_t j, int64_t width) {
      for (int64_t g = 0; g < 3; ++g)
        pack_b<T>({of.w_hh + (g * h + j) * h, 1, h}, h, width, weights(g, j));
    });
    for (int64_t t = 0; t < of.steps; ++t) {
      for_units<T>(h, [&](int64_t j, int64_t width) { step(t, j, width); });
      now.data.swap(next.data);
    }
  }
};

template <class T>
struct Backward {
  static constexpr int cols = Simd<T>::cols;
  explicit Backward(const GruGradArgs& args)
      : steps(args.gy.size(0)),
        n(args.gy.size(1)),
        h(args.h0.size(1)),
        gates(args.gates.data<T>()),
        y(args.y.data<T>()),
        h0(args.h0.data<T>()),
        w_hh(args.w_hh.data<T>()),
        gy(args.gy.data<T>()),
        g_gi(args.g_gi.data<T>()),
        g_gh(args.g_gh.data<T>()),
        out(args.out.data<T>()),
        packed(round_up(h, cols) * 3 * h) {}

  const int64_t steps, n, h;
  const T *gates, *y, *h0, *w_hh, *gy;
  T *g_gi, *g_gh, *out;
  Buffer<T> packed, direct{n * h};
  Panels<T> now{n, 3 * h}, next{n, 3 * h};  // g_gh of the step after this and of this one

  /// g [n, cols]: gradient of some units of the state after step t; -1: of h0.
  void carry(int64_t t, int64_t j, int64_t width, T* g) const {
    const bool last = t + 1 == steps;
    if (!last) now.times(packed.data() + j * 3 * h, g);
    for (int64_t i = 0; i < n; ++i) {
      T* to = g + i * cols;
      const T *straight = direct.data() + i * h + j, *from = gy + (t * n + i) * h + j;
      for (int64_t u = 0; u < width; ++u) {
        T x = last ? T(0) : straight[u] + to[u];
        if (t >= 0) x += from[u];
        to[u] = x;
      }
    }
  }

  void step(int64_t t, int64_t j, int64_t width) {
    const Buffer<T> g(n * cols);
    carry(t, j, width, g.data());
    const T* state = (t > 0 ? y + (t - 1) * n * h : h0) + j;
    for (int64_t i = 0; i < n; ++i) {
      const int64_t at = t * n + i;
      if (t < 0) {
        std::copy_n(g.data() + i * cols, width, out + i * h + j);
      } else {
        cell_grad(gates + at * 4 * h + j, state + i * h, g.data() + i * cols, h, width,
                  g_gi + at * 3 * h + j, g_gh + at * 3 * h + j, direct.data() + i * h + j);
      }
    }
    for (int64_t gate = 0; t >= 0 && gate < 3; ++gate)
      next.put(g_gh + t * n * 3 * h + gate * h + j, 3 * h, gate * h + j, width);
  }

  void run() {
    for_units<T>(h, [&](int64_t j, int64_t width) {
      pack_b<T>({w_hh + j, h, 1}, 3 * h, width, packed.data() + j * 3 * h);
    });
    for (int64_t t = steps - 1; t >= -1; --t) {
      for_units<T>(h, [&](int64_t j, int64_t width) { step(t, j, width); });
      now.data.swap(next.data);
    }
  }
};

}  // namespace

void gru(const GruArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR {
    const Layer<decltype(zero)> layer(args);
    const Frame<decltype(zero)> frame{layer};
    const int64_t k = layer.h + (frame.fits() ? layer.i : 0);  // else matmul() counts the inputs
    count_flops(6.0 * static_cast<double>(args.out.numel() * k));
    if (frame.fits()) return frame.run();
    Sequence<decltype(zero)>(layer, args).run();
  });
}

void gru_grad(const GruGradArgs& args) {
  count_flops(6.0 * static_cast<double>(args.gy.numel() * args.h0.size(1)));
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR { Backward<decltype(zero)>(args).run(); });
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace restage::cpu {
RESTAGE_KERNEL(gru, GruArgs)
RESTAGE_KERNEL(gru_grad, GruGradArgs)
}  // namespace restage::cpu
#endif
