// Linear recurrences (kernels/rnn.h): rows in parallel, their steps in turn; plain loops over a
// step's numbers, which the compiler makes vectors of. Bound by memory, so baseline code.
#include "autograd/base/parallel_each.h"
#include "autograd/cpu/common.h"
#include "autograd/cpu/kernels.h"

namespace restage::cpu {

void recurrence(const RecurrenceArgs& args) {
  const int64_t steps = args.out.size(1), m = args.out.size(2);
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    parallel_each(args.out.size(0), 1, [&](int64_t s) {
      const T* before = args.first.data<T>() + s * m;
      for (int64_t t = 0; t < steps; ++t) {
        const int64_t at = (s * steps + t) * m;
        const T *a = args.a.data<T>() + at, *b = args.b.data<T>() + at;
        T* y = args.out.data<T>() + at;
        for (int64_t i = 0; i < m; ++i) y[i] = a[i] * before[i] + b[i];
        before = y;
      }
    });
  });
}

void recurrence_grad(const RecurrenceGradArgs& args) {
  const int64_t steps = args.out.size(1), m = args.out.size(2);
  dispatch(args.out.dtype(), [&](auto zero) {
    using T = decltype(zero);
    parallel_each(args.out.size(0), 1, [&](int64_t s) {
      // A_(t+1) g_b_(t+1); in the end the gradient of `first`.
      T* later = args.g_first.data<T>() + s * m;
      std::fill_n(later, m, T(0));
      for (int64_t t = steps - 1; t >= 0; --t) {
        const int64_t at = (s * steps + t) * m;
        const T *a = args.a.data<T>() + at, *gy = args.gy.data<T>() + at;
        const T* before = t > 0 ? args.y.data<T>() + at - m : args.first.data<T>() + s * m;
        T *g_a = args.g_a.data<T>() + at, *g_b = args.out.data<T>() + at;
        for (int64_t i = 0; i < m; ++i) {
          g_b[i] = gy[i] + later[i];
          g_a[i] = g_b[i] * before[i];
          later[i] = g_b[i] * a[i];
        }
      }
    });
  });
}

}  // namespace restage::cpu
