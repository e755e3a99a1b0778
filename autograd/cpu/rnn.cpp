#include "autograd/cpu/common.h"
#include "autograd/cpu/kernels.h"

namespace restage::cpu {

void gru_cell(const GruCellArgs& args) {
  const int64_t h = args.h.size(1);
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    parallel_for(args.h.size(0), row_grain(4 * h), [&](int64_t from, int64_t to) {
      for (int64_t s = from; s < to; ++s) {
        const T* gi = args.gi.data<T>() + s * 3 * h;
        const T* gh = args.gh.data<T>() + s * 3 * h;
        T* gates = args.gates.data<T>() + s * 4 * h;
        const ConstArray<T> ir(gi, h), iz(gi + h, h), in(gi + 2 * h, h);
        const ConstArray<T> hr(gh, h), hz(gh + h, h), hn(gh + 2 * h, h),
            prev(args.h.data<T>() + s * h, h);
        MutableArray<T> r(gates, h), z(gates + h, h), n(gates + 2 * h, h), kept(gates + 3 * h, h);
        r = T(1) / (T(1) + (-(ir + hr)).exp());
        z = T(1) / (T(1) + (-(iz + hz)).exp());
        n = (in + r * hn).tanh();
        kept = hn;
        MutableArray<T>(args.out.data<T>() + s * h, h) = (T(1) - z) * n + z * prev;
      }
    });
  });
}

void gru_cell_grad(const GruCellGradArgs& args) {
  const int64_t h = args.h.size(1);
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    parallel_for(args.h.size(0), row_grain(4 * h), [&](int64_t from, int64_t to) {
      for (int64_t s = from; s < to; ++s) {
        const T* gates = args.gates.data<T>() + s * 4 * h;
        const ConstArray<T> r(gates, h), z(gates + h, h), n(gates + 2 * h, h), hn(gates + 3 * h, h);
        const ConstArray<T> prev(args.h.data<T>() + s * h, h), g(args.gy.data<T>() + s * h, h);
        T* gi = args.g_gi.data<T>() + s * 3 * h;
        T* gh = args.g_gh.data<T>() + s * 3 * h;
        MutableArray<T> ir(gi, h), iz(gi + h, h), in(gi + 2 * h, h);
        in = g * (T(1) - z) * (T(1) - n * n);
        iz = g * (prev - n) * z * (T(1) - z);
        ir = in * hn * r * (T(1) - r);
        MutableArray<T>(gh, h) = ir;
        MutableArray<T>(gh + h, h) = iz;
        MutableArray<T>(gh + 2 * h, h) = in * r;
        MutableArray<T>(args.out.data<T>() + s * h, h) = g * z;
      }
    });
  });
}

}  // namespace restage::cpu
