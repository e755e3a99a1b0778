// What an optimiser does with gradients: their norms, updates in place. Each kernel goes over a
// list of tensors of f32 or f64, since a network has many small ones and a GPU takes longer to
// launch a kernel than to go over one of them.
#pragma once

#include <span>

#include "autograd/kernels/kernel.h"

namespace restage {

/// Adam as PyTorch's (spec 7); `step` counts from 1. In float64 the two differ by rounding alone.
/// In float32 1 - beta is computed in float32, where PyTorch rounds that of float64: with beta2 =
/// 0.999 v is 1.29e-5 of itself smaller than PyTorch's, and a step 6.5e-6 of itself longer.
struct AdamArgs {
  struct Of {
    const Tensor& gradient;
    Tensor& out;  ///< the parameter
    Tensor& m;
    Tensor& v;
    int64_t step;
  };
  std::span<const Of> all;
  double lr, beta1, beta2, eps, weight_decay, gradient_scale;
  double keep = 1;  ///< so much of a parameter is left before it moves: AdamW's decay
};

/// out = keep * out + add * x, of one shape.
struct MixArgs {
  struct Of {
    const Tensor& x;
    Tensor& out;
  };
  std::span<const Of> all;
  double keep, add;
};

/// out [n], f64: the sum of the squares of each of n tensors, in double, in an order that its size
/// alone decides.
struct SquaredNormArgs {
  std::span<const Tensor> all;
  Tensor& out;
};

/// launch() of a kernel that writes `out` of every entry of its list. None may read what another
/// entry writes.
template <class Args>
void launch_all(const Args& args) {
  if (args.all.empty()) return;
  backend(args.all.front().out.device()).run(typeid(Args), &args);
  for (const auto& one : args.all) one.out.written();
}

/// MixArgs of one tensor.
inline void mix(const Tensor& x, Tensor& out, double keep, double add) {
  const MixArgs::Of one[] = {{x, out}};
  launch_all(MixArgs{one, keep, add});
}

}  // namespace restage
