#include <cmath>

#include "autograd/cpu/common.h"
#include "autograd/cpu/kernels.h"

namespace restage::cpu {

void adam(const AdamArgs& args) {
  const double c1 = 1.0 - std::pow(args.beta1, static_cast<double>(args.step));
  const double c2 = 1.0 - std::pow(args.beta2, static_cast<double>(args.step));
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    const T step_size = static_cast<T>(args.lr / c1), root = static_cast<T>(std::sqrt(c2));
    const T b1 = static_cast<T>(args.beta1), b2 = static_cast<T>(args.beta2),
            eps = static_cast<T>(args.eps);
    const T decay = static_cast<T>(args.weight_decay), gs = static_cast<T>(args.gradient_scale);
    parallel_for(args.out.numel(), kGrain, [&](int64_t from, int64_t to) {
      const int64_t n = to - from;
      MutableArray<T> w(args.out.data<T>() + from, n), m(args.m.data<T>() + from, n),
          v(args.v.data<T>() + from, n);
      const ConstArray<T> gradient(args.gradient.data<T>() + from, n);
      const Eigen::Array<T, Eigen::Dynamic, 1> g = gradient * gs + decay * w;
      m = b1 * m + (T(1) - b1) * g;
      v = b2 * v + (T(1) - b2) * g.square();
      if (args.v_max != nullptr) {
        MutableArray<T> top(args.v_max->data<T>() + from, n);
        top = top.max(v);
        w -= step_size * m / (top.sqrt() / root + eps);
      } else {
        w -= step_size * m / (v.sqrt() / root + eps);
      }
    });
  });
}

}  // namespace restage::cpu
