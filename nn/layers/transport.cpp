#include "nn/layers/transport.h"

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"
#include "autograd/ops/transport.h"

namespace restage {

Var transport_plan(const Var& similarity, const TransportOptions& o) {
  return sinkhorn(exp(scale(add_scalar(similarity, -1), 1 / o.temperature)), o.steps, o.epsilon);
}

Var transport_rows(const Var& plan) {
  return plan / reshape(sum(plan, 2), {plan.size(0), plan.size(1), 1});
}

}  // namespace restage
