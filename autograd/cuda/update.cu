// What optimisers do, a thread a number.
#include "autograd/cuda/kernels.h"

namespace restage::cuda {
namespace {

template <class T>
void squared_norm_of(const SquaredNormArgs& args) {
  constexpr int64_t kPart = 1 << 14;
  const T* x = at<T>(args.x);
  double* out = at<double>(args.out);
  const int64_t n = args.x.numel(), parts = (n + kPart - 1) / kPart;
  const Tensor room = parts > 1 ? scratch(args.out, parts) : args.out;
  double* part = at<double>(room);
  if (n == 0) return each(1, [=] RESTAGE_DEVICE(int64_t) { out[0] = 0; });
  groups(parts, [=] RESTAGE_DEVICE(const Group& g, int64_t p) {
    const int64_t count = n < (p + 1) * kPart ? n - p * kPart : kPart;
    const double total = g.sum(count, [&](int64_t i) {
      const double v = static_cast<double>(x[p * kPart + i]);
      return v * v;
    });
    g.each(1, [&](int64_t) { part[p] = total; });
  });
  if (parts == 1) return;
  groups(1, [=] RESTAGE_DEVICE(const Group& g, int64_t) {
    const double total = g.sum(parts, [&](int64_t p) { return part[p]; });
    g.each(1, [&](int64_t) { out[0] = total; });
  });
}

template <class T>
void adam_of(const AdamArgs& args) {
  const double c1 = 1.0 - std::pow(args.beta1, static_cast<double>(args.step));
  const double c2 = 1.0 - std::pow(args.beta2, static_cast<double>(args.step));
  const auto number = [](double x) { return static_cast<T>(x); };
  const T step_size = number(args.lr / c1), root = number(1 / std::sqrt(c2)),
          eps = number(args.eps), b1 = number(args.beta1), b2 = number(args.beta2),
          decay = number(args.weight_decay), gs = number(args.gradient_scale);
  T *w = at<T>(args.out), *m = at<T>(args.m), *v = at<T>(args.v);
  const T* gradient = at<T>(args.gradient);
  each(args.out.numel(), [=] RESTAGE_DEVICE(int64_t i) {
    const T g = fma(gradient[i], gs, decay * w[i]);
    m[i] = fma(b1, m[i], (T(1) - b1) * g);
    v[i] = fma(b2, v[i], (T(1) - b2) * (g * g));
    w[i] -= step_size * m[i] / fma(sqrt(v[i]), root, eps);
  });
}

template <class T>
void mix_of(const MixArgs& args) {
  const T* x = at<T>(args.x);
  T *out = at<T>(args.out), keep = static_cast<T>(args.keep), add = static_cast<T>(args.add);
  each(args.out.numel(), [=] RESTAGE_DEVICE(int64_t i) { out[i] = fma(keep, out[i], add * x[i]); });
}

}  // namespace

void squared_norm(const SquaredNormArgs& args) {
  RESTAGE_FLOATS(args.x.dtype(), squared_norm_of, args)
}
void adam(const AdamArgs& args) { RESTAGE_FLOATS(args.out.dtype(), adam_of, args) }
void mix(const MixArgs& args) { RESTAGE_FLOATS(args.out.dtype(), mix_of, args) }

}  // namespace restage::cuda
