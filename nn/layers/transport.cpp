#include "nn/layers/transport.h"

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/linear.h"
#include "autograd/ops/reduce.h"

namespace restage {

Var transport_plan(const Var& similarity, const TransportOptions& o) {
  const int64_t n = similarity.size(0), v = similarity.size(1), p = similarity.size(2);
  const DType type = similarity.dtype();
  const Device device = similarity.value.device();
  const Var kernel = exp(scale(add_scalar(similarity, -1), 1 / o.temperature));
  const Var row(Tensor::full({n, v, 1}, 1.0 / static_cast<double>(v), type, device));
  const Var column(Tensor::full({n, p, 1}, 1.0 / static_cast<double>(p), type, device));
  Var a = row, b;
  for (int i = 0; i < o.steps; ++i) {
    b = column / add_scalar(matmul(kernel, a, true), o.epsilon);
    a = row / add_scalar(matmul(kernel, b), o.epsilon);
  }
  return a * kernel * reshape(b, {n, 1, p});
}

Var transport_rows(const Var& plan) {
  return plan / reshape(sum(plan, 2), {plan.size(0), plan.size(1), 1});
}

}  // namespace restage
