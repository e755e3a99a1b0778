#include "nn/models/skeleton.h"

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"

namespace restage {

SkeletonAnswer on_host(const SkeletonAnswer& answer) {
  return {answer.joints.value.cpu(), answer.turns.value.cpu(), answer.uncertainty.value.cpu()};
}

Var bone_vectors(const Var& rest) {
  const int64_t n = rest.size(0);
  Tensor parents = Tensor::empty({n, kJoints - 1}, DType::i32);
  for (int64_t i = 0; i < n; ++i)
    for (int64_t j = 1; j < kJoints; ++j)
      parents.data<int32_t>()[i * (kJoints - 1) + j - 1] = kParents[j];
  return reshape(slice(rest, 1, 1, kJoints) - gather(rest, parents.to(rest.value.device())),
                 {n, 3 * (kJoints - 1)});
}

}  // namespace restage
