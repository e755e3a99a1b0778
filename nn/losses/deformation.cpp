#include "nn/losses/deformation.h"

#include "autograd/ops/elementwise.h"
#include "autograd/ops/reduce.h"

namespace restage {

Var skin_cross_entropy(const Var& weights, const Tensor& truth) {
  return neg(sum_all(log(add_scalar(weights, 1e-6)) * Var(truth)));
}

Var distance_sum(const Var& posed, const Var& truth, Measure measure) {
  return sum_all(errors(posed - truth, measure));
}

}  // namespace restage
