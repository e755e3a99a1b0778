// Clipping by the norm of what is optimised.
#include <gtest/gtest.h>

#include <cmath>

#include "autograd/gradcheck/evaluate.h"
#include "nn/layers/linear.h"
#include "train/optim/adam.h"

namespace restage {
namespace {

/// The weights after one step on gradients of `own` each; `foreign`: of a parameter of somebody
/// else that took part.
Tensor after_step(double own, double foreign, double clip) {
  Linear layer(2, 2, Init{RngKey{1, 0}, DType::f64}, false);
  const Parameter other(Tensor::zeros({2}, DType::f64));
  Gradients g;
  g.set(layer.weight.id, Tensor::full({2, 2}, own, DType::f64));
  if (foreign > 0) g.set(other.id, Tensor::full({2}, foreign, DType::f64));
  AdamConfig config;
  config.eps = 1e3;  // so that the size of a step follows that of the gradient
  Adam({{"", &layer}}, config).step(g, 1, clip);
  return layer.weight.value;
}

TEST(Clipping, IsByTheNormOfWhatIsOptimisedAndNothingElse) {
  using gradcheck::same_bits;
  const Tensor alone = after_step(3, 0, 1);
  EXPECT_TRUE(same_bits(alone, after_step(3, 1e6, 1)));
  EXPECT_FALSE(same_bits(alone, after_step(3, 0, 0))) << "a norm of 6 is clipped to 1";
  EXPECT_TRUE(same_bits(after_step(0.1, 1e6, 1), after_step(0.1, 0, 0))) << "one of 0.2 is not";
}

TEST(GradientNorms, AreOfTheLeavesThatAreNamed) {
  Gradients g;
  g.set(1, Tensor::full({2}, 3, DType::f64));
  g.set(7, Tensor::full({1}, 4, DType::f64));
  const std::vector<uint64_t> first{1}, both{1, 7}, with_absent{1, 5};
  EXPECT_DOUBLE_EQ(g.norm(first), std::sqrt(18.0));
  EXPECT_DOUBLE_EQ(g.norm(with_absent), std::sqrt(18.0));
  EXPECT_DOUBLE_EQ(g.norm(both), g.norm());
  EXPECT_DOUBLE_EQ(g.norm(), std::sqrt(34.0));
  g.set(7, Tensor::full({1}, 0, DType::f64));  // no stale part remains
  EXPECT_DOUBLE_EQ(g.norm(), std::sqrt(18.0));
}

}  // namespace
}  // namespace restage
