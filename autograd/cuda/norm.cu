// Normalisation over the middle axis of [outer, n, inner]; statistics in double.
#include "autograd/cuda/kernels.h"
#include "autograd/cuda/sums.h"

namespace restage::cuda {
namespace {

/// Scale or shift of a number, 1 or 0 where there is none.
template <class T>
struct Factor {
  const T* values;
  Affine along;
  double none;
  RESTAGE_DEVICE double at(int64_t r, int64_t i) const {
    if (values == nullptr || along == Affine::none) return none;
    return static_cast<double>(values[along == Affine::inner ? i : r]);
  }
};

template <class T>
void norm_of(const NormArgs& args) {
  const T* x = at<T>(args.x);
  T* out = at<T>(args.out);
  double *mean = at<double>(args.mean), *rstd = at<double>(args.rstd);
  const int64_t n = args.n, inner = args.inner;
  const double count = static_cast<double>(n), eps = args.eps;
  const Factor<T> scale{at<T>(args.scale), args.affine, 1},
      shift{at<T>(args.shift), args.affine, 0};
  sums(
      args.out, args.outer, n, inner,
      [=] RESTAGE_DEVICE(int64_t o, int64_t r, int64_t i) {
        return static_cast<double>(x[(o * n + r) * inner + i]);
      },
      [=] RESTAGE_DEVICE(int64_t k, double total) { mean[k] = total / count; });
  sums(
      args.out, args.outer, n, inner,
      [=] RESTAGE_DEVICE(int64_t o, int64_t r, int64_t i) {
        const double d = static_cast<double>(x[(o * n + r) * inner + i]) - mean[o * inner + i];
        return d * d;
      },
      [=] RESTAGE_DEVICE(int64_t k, double total) { rstd[k] = 1.0 / sqrt(total / count + eps); });
  rows(args.outer * n, inner, [=] RESTAGE_DEVICE(int64_t row, int64_t i) {
    const int64_t r = row % n, c = row / n * inner + i, k = row * inner + i;
    out[k] = static_cast<T>((static_cast<double>(x[k]) - mean[c]) * rstd[c] * scale.at(r, i) +
                            shift.at(r, i));
  });
}

template <class T>
void norm_grad_of(const NormGradArgs& args) {
  const T *x = at<T>(args.x), *gy = at<T>(args.gy);
  T* out = at<T>(args.out);
  const double *mean = at<double>(args.mean), *rstd = at<double>(args.rstd);
  const int64_t outer = args.outer, n = args.n, inner = args.inner, columns = outer * inner;
  const Factor<T> scale{at<T>(args.scale), args.affine, 1};
  Tensor room = scratch(args.out, 2 * columns);
  double *g_sum = at<double>(room), *gx_sum = g_sum + columns;
  sums<Sums<2>>(
      args.out, outer, n, inner,
      [=] RESTAGE_DEVICE(int64_t o, int64_t r, int64_t i) {
        const int64_t k = (o * n + r) * inner + i, c = o * inner + i;
        const double g = static_cast<double>(gy[k]) * scale.at(r, i);
        return Sums<2>{{g, g * ((static_cast<double>(x[k]) - mean[c]) * rstd[c])}};
      },
      [=] RESTAGE_DEVICE(int64_t k, const Sums<2>& total) {
        g_sum[k] = total.of[0], gx_sum[k] = total.of[1];
      });
  const double inv = n > 0 ? 1.0 / static_cast<double>(n) : 0;
  rows(outer * n, inner, [=] RESTAGE_DEVICE(int64_t row, int64_t i) {
    const int64_t r = row % n, c = row / n * inner + i, k = row * inner + i;
    const double h = (static_cast<double>(x[k]) - mean[c]) * rstd[c];
    const double g = static_cast<double>(gy[k]) * scale.at(r, i);
    out[k] = static_cast<T>(rstd[c] * (g - inv * (g_sum[c] + h * gx_sum[c])));
  });
  if (args.g_scale == nullptr) return;
  // Along the inner axis there is one block; along the middle one the columns are what is summed.
  const int64_t width = args.affine == Affine::inner ? inner : n,
                blocks = args.affine == Affine::inner ? n : outer;
  const bool by_inner = args.affine == Affine::inner;
  T *g_scale = at<T>(args.g_scale), *g_shift = at<T>(args.g_shift);
  sums<Sums<2>>(
      args.out, 1, blocks, width,
      [=] RESTAGE_DEVICE(int64_t, int64_t r, int64_t i) {
        const int64_t k = r * width + i, c = by_inner ? i : r;
        const double g = static_cast<double>(gy[k]);
        return Sums<2>{{g, g * ((static_cast<double>(x[k]) - mean[c]) * rstd[c])}};
      },
      [=] RESTAGE_DEVICE(int64_t k, const Sums<2>& total) {
        g_shift[k] = static_cast<T>(total.of[0]), g_scale[k] = static_cast<T>(total.of[1]);
      });
}

}  // namespace

void norm(const NormArgs& args) {
  if (args.x.numel() > 0) RESTAGE_FLOATS(args.out.dtype(), norm_of, args)
}
void norm_grad(const NormGradArgs& args) { RESTAGE_FLOATS(args.out.dtype(), norm_grad_of, args) }

}  // namespace restage::cuda
