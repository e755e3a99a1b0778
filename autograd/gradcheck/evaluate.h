// One forward and backward run of a sample: what the checks of the harness compare.
#pragma once

#include "autograd/gradcheck/gradcheck.h"
#include "autograd/ops/elementwise.h"

namespace restage::gradcheck {

struct Evaluation {
  Tensor value;
  std::vector<Tensor> gradients;  ///< one per input; undefined if the input received none
};

/// The result of the sample with these inputs, on the sample's device and without a tape.
Var built(const Sample& s, const std::vector<Tensor>& inputs);
/// The same result in the host's memory.
Tensor value_of(const Sample& s, const std::vector<Tensor>& inputs);

/// Value, and gradients of sum(u * value), with the inputs that `on_tape` picks (null: all) as
/// leaves. An input that the result does not depend on has a gradient of zeros.
Evaluation evaluate(const Sample& s, const Tensor& u,
                    const std::function<bool(size_t)>& on_tape = nullptr);

bool same_bits(const Tensor& a, const Tensor& b);
bool same_bits(const Evaluation& a, const Evaluation& b);

}  // namespace restage::gradcheck
