// GRU layers. The rows of a batch never meet, so each thread takes some rows through all steps: no
// waiting between steps, and the recurrent weights are packed once for the whole sequence.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "autograd/cpu/rnn.cpp"
#include <hwy/foreach_target.h>  // once per instruction set

#include "autograd/cpu/common.h"
#include "autograd/cpu/gemm_tile-inl.h"
#include "autograd/cpu/kernels.h"
#include "autograd/cpu/math-inl.h"
#include "autograd/cpu/targets.h"
#include "autograd/kernels/scratch.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {
namespace {

/// Rows per piece: a function of the batch alone. Fewer rows than the register tile has cost no
/// more than a full tile, so small batches are still cut in two.
int piece_rows(int64_t n) {
  if (n <= 8) return 4;
  return kRows > 8 && n <= 16 ? 8 : kRows;
}

/// [rows, k] times packed columns -> [rows, n], rows <= Rows.
template <class T, int Rows>
void rows_times(const T* x, int64_t rows, int64_t k, const Scratch<T>& packed, int64_t n,
                Scratch<T>& panel, T* out) {
  constexpr int cols = Simd<T>::cols;
  for (int64_t l = 0; l < k; ++l)
    for (int64_t i = 0; i < Rows; ++i)
      panel[static_cast<size_t>(l * Rows + i)] = i < rows ? x[i * k + l] : T(0);
  T tile[Rows * cols];
  for (int64_t j0 = 0; j0 < n; j0 += cols) {
    multiply<T, Rows>(k, panel.data(), packed.data() + j0 * k, tile);
    const int64_t width = std::min<int64_t>(cols, n - j0);
    for (int64_t i = 0; i < rows; ++i) std::copy_n(tile + i * cols, width, out + i * n + j0);
  }
}

template <class T>
void rows_times(int piece, const T* x, int64_t rows, int64_t k, const Scratch<T>& packed, int64_t n,
                Scratch<T>& panel, T* out) {
  if (piece == 4) return rows_times<T, 4>(x, rows, k, packed, n, panel, out);
  if (piece == 8) return rows_times<T, 8>(x, rows, k, packed, n, panel, out);
  rows_times<T, kRows>(x, rows, k, packed, n, panel, out);
}

/// A matrix [k, n] (by strides) in the layout of multiply().
template <class T>
Scratch<T> packed(const Strided<T>& m, int64_t k, int64_t n) {
  constexpr int cols = Simd<T>::cols;
  Scratch<T> out(static_cast<size_t>((n + cols - 1) / cols * cols * k));
  pack_b(m, k, n, out.data());
  return out;
}

template <class T>
void cell(const T* gi, const T* gh, const T* bias, const T* previous, int64_t h, T* gates, T* out) {
  T *r = gates, *z = gates + h, *n = gates + 2 * h, *kept = gates + 3 * h;
  const auto gate = [](auto i, auto hidden, auto b)
                        HWY_ATTR { return sigmoid(hn::Add(hn::Add(i, hidden), b)); };
  map(h, r, gate, gi, gh, bias);
  map(h, z, gate, gi + h, gh + h, bias + h);
  map(
      h, kept, [](auto a, auto b) HWY_ATTR { return hn::Add(a, b); }, gh + 2 * h, bias + 2 * h);
  map(
      h, n, [](auto i, auto reset, auto k) HWY_ATTR { return tanh(hn::MulAdd(reset, k, i)); },
      gi + 2 * h, r, kept);
  for (int64_t i = 0; i < h; ++i) out[i] = (T(1) - z[i]) * n[i] + z[i] * previous[i];
}

/// g: gradient of the new state; on return `direct` holds the part that goes straight to the old
/// one.
template <class T>
void cell_grad(const T* gates, const T* previous, const T* g_out, int64_t h, T* gi, T* gh,
               T* direct) {
  for (int64_t i = 0; i < h; ++i) {
    const T r = gates[i], z = gates[h + i], n = gates[2 * h + i], hn = gates[3 * h + i];
    const T g = g_out[i];
    const T in = g * (T(1) - z) * (T(1) - n * n);
    const T iz = g * (previous[i] - n) * z * (T(1) - z);
    const T ir = in * hn * r * (T(1) - r);
    gi[i] = gh[i] = ir;
    gi[h + i] = gh[h + i] = iz;
    gi[2 * h + i] = in;
    gh[2 * h + i] = in * r;
    direct[i] = g * z;
  }
}

template <class T>
void forward(const GruArgs& args) {
  const int64_t steps = args.gi.size(0), n = args.gi.size(1), h = args.h0.size(1);
  const Scratch<T> w = packed<T>({args.w_hh.data<T>(), 1, h}, h, 3 * h);
  const int piece = piece_rows(n);
  parallel_for(n, piece, [&](int64_t from, int64_t to) HWY_ATTR {
    const int64_t rows = to - from;
    Scratch<T> panel(static_cast<size_t>(h * piece)), gh(static_cast<size_t>(rows * 3 * h));
    const T* previous = args.h0.data<T>() + from * h;
    for (int64_t t = 0; t < steps; ++t) {
      rows_times(piece, previous, rows, h, w, 3 * h, panel, gh.data());
      T* out = args.out.data<T>() + (t * n + from) * h;
      for (int64_t i = 0; i < rows; ++i)
        cell(args.gi.data<T>() + (t * n + from + i) * 3 * h, gh.data() + i * 3 * h,
             args.b_hh.data<T>(), previous + i * h, h,
             args.gates.data<T>() + (t * n + from + i) * 4 * h, out + i * h);
      previous = out;
    }
  });
}

template <class T>
void backward(const GruGradArgs& args) {
  const int64_t steps = args.gy.size(0), n = args.gy.size(1), h = args.h0.size(1);
  const Scratch<T> w = packed<T>({args.w_hh.data<T>(), h, 1}, 3 * h, h);
  const int piece = piece_rows(n);
  parallel_for(n, piece, [&](int64_t from, int64_t to) HWY_ATTR {
    const int64_t rows = to - from, count = rows * h;
    Scratch<T> panel(static_cast<size_t>(3 * h * piece)), carry(static_cast<size_t>(count), T(0));
    Scratch<T> direct(static_cast<size_t>(count)), through(static_cast<size_t>(count));
    for (int64_t t = steps - 1; t >= 0; --t) {
      const int64_t at = t * n + from;
      const T* gy = args.gy.data<T>() + at * h;
      for (int64_t i = 0; i < count; ++i) carry[static_cast<size_t>(i)] += gy[i];
      const T* previous = t > 0 ? args.y.data<T>() + (at - n) * h : args.h0.data<T>() + from * h;
      for (int64_t i = 0; i < rows; ++i)
        cell_grad(args.gates.data<T>() + (at + i) * 4 * h, previous + i * h, carry.data() + i * h,
                  h, args.g_gi.data<T>() + (at + i) * 3 * h, args.g_gh.data<T>() + (at + i) * 3 * h,
                  direct.data() + i * h);
      rows_times(piece, args.g_gh.data<T>() + at * 3 * h, rows, 3 * h, w, h, panel, through.data());
      for (size_t i = 0; i < carry.size(); ++i) carry[i] = direct[i] + through[i];
    }
    std::copy_n(carry.data(), count, args.out.data<T>() + from * h);
  });
}

}  // namespace

void gru(const GruArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR { forward<decltype(zero)>(args); });
}

void gru_grad(const GruGradArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR { backward<decltype(zero)>(args); });
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace restage::cpu {
RESTAGE_KERNEL(gru, GruArgs)
RESTAGE_KERNEL(gru_grad, GruGradArgs)
}  // namespace restage::cpu
#endif
